"""A training run of our own PPO, from start to end, or from where it stopped.

It stops at any time with a policy. It goes on from its last checkpoint, exactly as a run that was not stopped does, if
its budget is one of steps: CPU seconds are never the same twice.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from cps_agents.console import to_json
from cps_agents.files import write_text
from cps_agents.learning.checkpoint import damaged, read_arrays, restore, write_checkpoint
from cps_agents.learning.copies import Copies
from cps_agents.learning.episode_noise import EpisodeNoise
from cps_agents.learning.ppo import Learner, LearningProgress
from cps_agents.learning.recipe import Recipe, knobs_of
from cps_agents.learning.run import Report, TrainingJob, recording
from cps_agents.learning.tracking import RunTracker
from cps_agents.learning.warm_start import read_start
from cps_agents.zoo.card import Card
from cps_agents.zoo.files import save, starts_of
from cps_agents.zoo.own import card_of_network
from cps_agents.zoo.wired import Head, wired_policy, with_scaling
from cps_envs.core.declare.seeds import VALIDATION
from cps_envs.core.game.play import play_episodes
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.learning.wiring import Scaling
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.policies.policy import Idle, Policy
from cps_envs.core.types import Array, Role, other
from cps_envs.registration import find_problem

CHECKPOINT = "checkpoint.safetensors"
CHECKPOINT_EVERY_S = 5.0  # seconds after which the next update ends with a checkpoint, ...
CHECKPOINT_EVERY = 0.05  # ... or share of the budget, whatever comes first
SAID_EVERY_S = 5.0  # in `run.json`, which other processes read to show how far it is


def train(job: TrainingJob, report: Report) -> None:
    """Train with our own PPO; see `learner.learn`.

    Raises:
        CommandError: the recipe does not fit the role, or the checkpoint is damaged.
    """
    path = job.folder / CHECKPOINT
    arrays = read_arrays(path) if path.is_file() else None
    learner = make_learner(job.recipe, job.seed, arrays)
    if arrays is not None:
        try:
            restore(learner, arrays)
        except ValueError as error:
            raise damaged(path, error) from error
    with recording(job) as tracker:
        keeper = Keeper(job, learner, tracker, report)
        try:
            keeper.begin()
            learner.learn(keeper.after)
            keeper.end()
        except KeyboardInterrupt:
            keeper.save_unfinished()
            raise


def make_learner(recipe: Recipe, seed: int, arrays: Mapping[str, Array] | None = None) -> Learner:
    """A recipe's learner with its environments; `arrays` of a checkpoint have the scaling of the inputs.

    Raises:
        CommandError: the policy that learning begins with does not fit.
    """
    start = read_start(recipe)
    envs = make_envs(recipe, seed, arrays, None if start is None else start.scaling)
    kind = EpisodeNoise if recipe.ppo.episode_noise else Copies if recipe.ppo.copies > 1 else Learner
    learner = kind(envs, recipe, seed)
    if start is not None:
        start.put(learner.network)
    return learner


def make_envs(
    recipe: Recipe, seed: int, arrays: Mapping[str, Array] | None = None, scaling: Scaling | None = None
) -> LearningVectorEnv:
    """The environments of a recipe, whose inputs are scaled as a checkpoint's `arrays` or `scaling` say, or anew."""
    problem = find_problem(recipe.problem)
    if arrays is not None:
        mean, deviation = (tuple(np.ravel(arrays.get(name, ())).tolist()) for name in ("mean", "deviation"))
        scaling = mean, deviation
    return LearningVectorEnv(
        problem,
        recipe.role,
        preset=recipe.preset,
        training=recipe.training,
        opponent=recipe.rival if recipe.training.opponent else None,
        seed=seed,
        copies=2 if recipe.ppo.episode_noise else recipe.ppo.copies,
        scaling=scaling,
        **recipe.overrides,
    )


def validate(recipe: Recipe, policy: Policy) -> dict[str, Array]:
    """What the validation episodes of a recipe end with, (B,) each, when a policy plays its role."""
    players: Mapping[Role, PolicyReference] = {recipe.role: policy, other(recipe.role): recipe.rival}
    seeds = VALIDATION[: recipe.evaluation_episodes]
    return play_episodes(find_problem(recipe.problem), recipe.venue.config, players, seeds)


def is_due(share: float, seconds: float) -> bool:
    """Whether a checkpoint is due, this share of the budget and so many seconds after the last one."""
    return share >= CHECKPOINT_EVERY or seconds >= CHECKPOINT_EVERY_S


class Keeper:
    """Evaluates on validation seeds, keeps the best network, writes checkpoints, and says how far it is."""

    def __init__(self, job: TrainingJob, learner: Learner, tracker: RunTracker, report: Report) -> None:
        self._job, self._learner = job, learner
        self._tracker, self._report = tracker, report
        self._game = learner.envs.game
        self._spec = self._game.spec(job.recipe.role)
        self._best = job.read().get("best_score")
        self._saved_s, self._saved_share = time.monotonic(), learner.share  # what there is needs no checkpoint
        self._said_s = -np.inf
        self._untrained = True  # whether no evaluation has seen a network that has learned
        self._idle = 0.0  # what the neutral policy gets
        self._validation = ""
        self._next = self._after(learner.share)

    def begin(self) -> None:
        """The first evaluation; of a run that goes on, what came after its checkpoint is forgotten."""
        job, steps = self._job, self._learner.steps
        self._idle = job.recipe.score(validate(job.recipe, Idle(self._spec)))
        rows = [json.dumps(json.loads(to_json(row))) for row in job.evaluations() if row["steps"] <= steps]
        if rows:
            write_text(job.folder / "evaluations.jsonl", "".join(f"{row}\n" for row in rows) if steps else "")
        if steps == 0:
            self.evaluate()
        self.say(self._learner.progress())

    def after(self, progress: LearningProgress) -> None:
        """What follows an update."""
        if progress.share >= self._next:
            self._next = self._after(progress.share)
            self.evaluate()
        if is_due(progress.share - self._saved_share, time.monotonic() - self._saved_s):
            write_checkpoint(self._job.folder / CHECKPOINT, self._learner)
            self._note()
            self._saved_s, self._saved_share = time.monotonic(), progress.share
        self.say(progress)

    def end(self) -> None:
        """The last word."""
        self._job.write(done=self._job.recipe.budget)
        self._note()

    def save_unfinished(self) -> None:
        """Leave a policy that has learned, if any has; the checkpoint stays what it is."""
        if self._untrained and self._learner.steps > 0:
            self.evaluate()
        self._note()

    def say(self, progress: LearningProgress) -> None:
        """Print one line."""
        paid = "" if np.isnan(progress.training_return) else f"return {progress.training_return:.3g}, "
        speed = f"{progress.steps_per_s:,.0f} steps/CPU s, {progress.left_s:.0f} CPU s left" if progress.steps else ""
        note = f"{paid}{self._validation}, {speed}".rstrip(", ")
        done = int(progress.share * self._job.recipe.budget)
        self._report(done, note)
        if time.monotonic() - self._said_s > SAID_EVERY_S:
            self._job.write(done=done)
            self._said_s = time.monotonic()
        if paid:
            self._tracker.log({"train/return": progress.training_return}, progress.steps)

    def evaluate(self) -> None:
        """Play validation episodes with the network as it is; if it is the best so far, keep it."""
        job, learner = self._job, self._learner
        network = with_scaling(learner.network.exported(), learner.envs.wired.wiring)
        outcome = validate(job.recipe, wired_policy(self._spec, self._card({}), network))
        score, self._untrained = job.recipe.score(outcome), learner.steps == 0
        row = {"steps": learner.steps, "cpu_s": round(learner.cpu_s, 1), "validation": score, "none": self._idle}
        job.append_evaluation({**row, **{name: float(values.mean()) for name, values in outcome.items()}})
        self._tracker.log({"validation/score": score}, learner.steps)
        if self._best is None or score > self._best or not job.card.is_file():
            self._best = score
            starts = {job.seed: network} if learner.steps == 0 else starts_of(job.card) if job.card.is_file() else {}
            save(job.card, self._card(row), {job.seed: network}, starts)
        self._validation = f"validation {score:.3g} (best {self._best:.3g}, none {self._idle:.3g})"

    def _after(self, share: float) -> float:
        """The share of the budget at which the next evaluation is due."""
        times = max(self._job.recipe.evaluations, 1)
        return (int(share * times + 1e-9) + 1) / times

    def _note(self) -> None:
        learner = self._learner
        self._job.write(steps=learner.steps, cpu_s=round(learner.cpu_s, 1), best_score=self._best)

    def _card(self, facts: Mapping[str, Any]) -> Card:
        """The card of the policy with the `facts` about its training seed."""
        job, recipe, envs = self._job, self._job.recipe, self._learner.envs
        return card_of_network(
            envs,
            recipe.role,
            envs.wired.space(),
            envs.single_action_space,
            Head(sampled=recipe.training.sampled),
            name=recipe.name,
            problem=recipe.problem,
            algorithm=recipe.algorithm if recipe.start or facts.get("steps") else "untrained",
            opponent=recipe.rival,
            recipe=knobs_of(recipe),
            best=job.seed,
            seeds={str(job.seed): facts},
            command=job.command,
        )
