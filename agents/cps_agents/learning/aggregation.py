"""Dataset aggregation for networks that remember: the student plays, the teacher labels every decision, all is learned.

After Ross, Gordon and Bagnell, A reduction of imitation learning and structured prediction to no-regret online learning
(AISTATS 2011). The teacher plays the first round itself. It may know what the student has to find out.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger

from cps_agents.learning.callback import TrackerWriter, TrainingCallback
from cps_agents.learning.export import make_card, network_of_model, policy_of
from cps_agents.learning.imitation import Sequences, collect, imitate_sequences, joined, read_sequences, write_sequences
from cps_agents.learning.model import make_model, scaling_of
from cps_agents.learning.run import Report, Run
from cps_agents.learning.tracking import RunTracker
from cps_agents.learning.training_envs import TrainingEnvs
from cps_envs.core.seeds import training_seed


def begin_taught(run: Run, device: str, envs: TrainingEnvs, report: Report) -> BaseAlgorithm:
    """A recurrent model after the rounds of imitation from which it goes on to learn by reward."""
    rounds = Aggregation(run, envs)
    model = rounds.begin(device)
    for number in range(run.recipe.teacher_rounds):
        if number > 0:
            rounds.show(model)
        report(0, f"imitation, round {number + 1}: loss {rounds.learn(model):.3g}")
    rounds.forget()
    return model


def aggregate(
    model: BaseAlgorithm | None,
    run: Run,
    device: str,
    envs: TrainingEnvs,
    callback: TrainingCallback,
    tracker: RunTracker,
    report: Report,
) -> None:
    """Whole rounds until the teacher has labelled `total_steps` decisions; each ends with a checkpoint.

    The last `evaluations` rounds are validated, as if all were as long as the one before.

    `model` is that of the checkpoint to go on from.

    Raises:
        CommandError: the demonstrations that the checkpoint has learned are damaged.
    """
    rounds = Aggregation(run, envs)
    if model is None:
        model = rounds.begin(device)
    else:
        rounds.recall(model.num_timesteps)
    callback.init_callback(model)
    model.set_logger(Logger(folder=None, output_formats=[TrackerWriter(tracker)]))
    while model.num_timesteps < run.recipe.total_steps:
        report(model.num_timesteps, callback.note)
        if rounds.decisions == model.num_timesteps:
            rounds.show(model)
        model.logger.record("imitation/loss", rounds.learn(model))
        model.num_timesteps = callback.num_timesteps = rounds.decisions
        left = 0 if callback.spent else run.recipe.total_steps - rounds.decisions
        if left < max(run.recipe.evaluations, 1) * rounds.decisions / rounds.rounds:
            callback.evaluate()
        callback.save()
        model.logger.dump(model.num_timesteps)
        if callback.spent:
            break
    report(model.num_timesteps, callback.note)
    rounds.forget()


class Aggregation:
    """The rounds of a run, each a file of its folder until the run is over.

    Round n draws from generators of its own, so that a run which goes on after a round is the run that never stopped.
    """

    def __init__(self, run: Run, envs: TrainingEnvs) -> None:
        self._run, self._envs = run, envs
        self._parts: list[Sequences] = []

    @property
    def decisions(self) -> int:
        """Decisions labelled so far."""
        return sum(part.decisions for part in self._parts)

    @property
    def rounds(self) -> int:
        """Rounds collected so far."""
        return len(self._parts)

    def begin(self, device: str) -> BaseAlgorithm:
        """An untrained model, whose inputs are scaled to the first round, which the teacher plays."""
        shown = self.show()
        run = self._run
        scaling = scaling_of(self._envs, run.recipe, shown.observations[shown.valid])
        return make_model(run.recipe, self._envs, scaling, run.seed, device)

    def recall(self, decisions: int) -> None:
        """Read the rounds that a checkpoint has learned, which are this many decisions.

        Raises:
            CommandError: a file is missing or damaged.
        """
        while self.decisions < decisions:
            self._parts.append(read_sequences(self._file(self.rounds)))

    def show(self, model: BaseAlgorithm | None = None) -> Sequences:
        """Collect and keep the next round, which the model plays, or else the teacher."""
        recipe, student = self._run.recipe, None
        first = training_seed(self._run.seed) + self.rounds * recipe.teacher_episodes
        if model is not None:
            student = policy_of(make_card(self._run, self._envs, {}), network_of_model(model, recipe.activation))
        shown = collect(recipe, range(first, first + recipe.teacher_episodes), student)
        write_sequences(self._file(self.rounds), shown)
        self._parts.append(shown)
        return shown

    def learn(self, model: BaseAlgorithm) -> float:
        """Fit the model to all that has been shown; returns the last epoch's mean loss."""
        generator = np.random.default_rng([training_seed(self._run.seed), self.rounds])
        return imitate_sequences(model.policy, joined(self._parts), self._run.recipe, generator)

    def forget(self) -> None:
        """Delete the files."""
        shutil.rmtree(self._folder, ignore_errors=True)

    @property
    def _folder(self) -> Path:
        return self._run.folder / "demonstrations"

    def _file(self, number: int) -> Path:
        return self._folder / f"round-{number}.safetensors"
