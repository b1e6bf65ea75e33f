"""A run that chooses the numbers of a family of policies: its episodes, its validation, and the card it leaves."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from cps_agents.errors import CommandError
from cps_agents.learning.learner import Report
from cps_agents.learning.recipe import Recipe, count_episodes, knobs_of
from cps_agents.learning.run import Job, Run
from cps_agents.learning.seeds import SEEDS_PER_RUN, VALIDATION, training_seed
from cps_agents.learning.tracking import Tracker
from cps_agents.machine import versions
from cps_agents.zoo.card import Card, read_card
from cps_agents.zoo.files import find, load, save
from cps_agents.zoo.numbers import Numbers
from cps_agents.zoo.policy import count_actions
from cps_baselines.family import Family, find_family, play_family
from cps_envs.core.lookup import PolicyReference
from cps_envs.core.types import FloatArray, other
from cps_envs.registration import find_problem

ZOO = "zoo:"


class Episodes(NamedTuple):
    """What a scene plays."""

    config: Any
    opponent: PolicyReference
    seeds: Sequence[int]


def episodes_of(recipe: Recipe, first_seed: int, times: int = 1) -> Iterator[Episodes]:
    """Scene by scene, `times` as many episodes as a candidate is judged by in a search, each with its own seed."""
    problem = find_problem(recipe.problem)
    for scene in recipe.scenes:
        preset, count = scene.preset or recipe.preset, scene.episodes * times
        config = problem.config(preset, {**recipe.overrides, **scene.overrides})
        opponent = scene.opponent or recipe.opponent or problem.opponents[preset][other(recipe.role)]
        yield Episodes(config, opponent, range(first_seed, first_seed + count))
        first_seed += count


def play_scenes(recipe: Recipe, family: Family, values: FloatArray, first_seed: int, times: int = 1) -> FloatArray:
    """What each candidate reached, (P, episodes), by its numbers (P, k); the same episodes for all.

    `times` as many episodes of each scene as a candidate is judged by in a search.
    """
    problem, reached = find_problem(recipe.problem), []
    for config, opponent, seeds in episodes_of(recipe, first_seed, times):
        rows = np.repeat(values, len(seeds), axis=0)
        outcome = play_family(family, problem, config, opponent, rows, [*seeds] * len(values))
        reached.append(recipe.values(outcome).reshape(len(values), len(seeds)))
    return np.concatenate(reached, axis=1)


def family_of(recipe: Recipe, seed: int = 0) -> Family:
    """The family whose numbers a recipe chooses; what it does not search are the numbers of the teacher's `seed`.

    Raises:
        CommandError: it names none, or one of another role, or the teacher lacks numbers that are not searched.
        UnknownNameError: there is no such family or teacher.
    """
    if not recipe.family:
        raise CommandError(f"{recipe.name} names no family of policies to search: add --knob family=NAME")
    family = find_family(recipe.family)
    if (family.problem, family.role) != (recipe.problem, recipe.role):
        raise CommandError(
            f"the family {recipe.family} has {family.role}s of {family.problem}; {recipe.name} trains the "
            f"{recipe.role} of {recipe.problem}"
        )
    kept = [name for name, moves in zip(family.names, family.free.tolist(), strict=True) if not moves]
    if not kept:
        return family
    taught = numbers_of(recipe.teacher, seed) if recipe.teacher.startswith(ZOO) else {}
    if missing := [name for name in kept if name not in taught]:
        raise CommandError(
            f"{recipe.family} needs a teacher that has its numbers; {missing[0]} is missing: "
            "add --knob teacher=zoo:NAME"
        )
    return family.beginning_at(taught)


def numbers_of(teacher: str, seed: int) -> dict[str, float]:
    """The numbers of a trained policy, `zoo:NAME`, by name: of this training seed, or of the best where it has none."""
    path = find(teacher.removeprefix(ZOO))
    card, found = load(path, seed if str(seed) in read_card(path).seeds else None)
    return dict(zip(card.numbers, found.values.tolist(), strict=True)) if isinstance(found, Numbers) else {}


class FamilyRun(ABC):
    """A run in updates, each of which plays new episodes; what it has found so far is `point`, in the family's steps.

    A subclass brings itself to where its checkpoint ends.
    """

    candidates: int  # that play the episodes of an update

    def __init__(self, job: Job, family: Family, tracker: Tracker) -> None:
        self.run, self.recipe, self.family, self.tracker = job.run, job.recipe, family, tracker
        self.done = 0  # updates so far
        self.episodes = count_episodes(self.recipe.scenes)
        self.updates = max(self.recipe.total_steps // (self.candidates * self.episodes), 1)
        self._cpu_before_s, self._started_s = float(job.run.read().get("cpu_s", 0.0)), time.process_time()

    @property
    @abstractmethod
    def point(self) -> FloatArray:
        """What is found so far, (f,)."""

    @abstractmethod
    def note(self) -> str:
        """How far it has come, in two or three words."""

    @abstractmethod
    def update(self, first_seed: int) -> dict[str, float]:
        """Play the episodes of an update, move, and write the checkpoint; returns what is to be drawn as curves."""

    @property
    def cpu_s(self) -> float:
        """CPU seconds of this run so far."""
        return round(self._cpu_before_s + time.process_time() - self._started_s, 1)

    @property
    def steps(self) -> int:
        """Episodes played so far, but for validation."""
        return self.done * self.candidates * self.episodes

    def go_on(self, report: Report) -> None:
        """Update to the end, with validation at equal distances."""
        distance = max(self.updates // max(self.recipe.evaluations, 1), 1)
        while self.done < self.updates and not 0 < self.recipe.most_cpu_s <= self.cpu_s:
            if self.done % distance == 0:
                self._validate()
            report(self.steps, self._told())
            curves = self.update(training_seed(self.run.seed) + self.done * self.episodes % SEEDS_PER_RUN)
            self.run.write(steps=self.steps, cpu_s=self.cpu_s)
            self.tracker.log(curves, self.steps)
        self._validate()
        report(self.steps, self._told())

    def values(self) -> FloatArray:
        """The numbers (1, k) that are found so far."""
        return self.family.values(self.point[np.newaxis])

    def _validate(self) -> None:
        """Play validation episodes with what is found; if it is the best so far, keep it."""
        rows = list(self.run.evaluations())
        if any(row["steps"] == self.steps for row in rows):
            return
        times = max(self.recipe.evaluation_episodes // self.episodes, 1)
        reached = play_scenes(self.recipe, self.family, self.values(), VALIDATION[0], times)
        row = {"steps": self.steps, "cpu_s": self.cpu_s, "validation": float(reached.mean())}
        if row["validation"] > max((float(each["validation"]) for each in rows), default=-np.inf):
            numbers = Numbers(self.values()[0])
            save(self.run.card, make_card(self.run, self.family, row), {self.run.seed: numbers})
            self.run.write(best_score=row["validation"])
        self.run.append_evaluation(row)
        self.tracker.log({"validation/score": row["validation"]}, self.steps)

    def _told(self) -> str:
        scores = [float(row["validation"]) for row in self.run.evaluations()]
        return f"validation {scores[-1]:.4g}, best {max(scores):.4g}, {self.note()}"


def make_card(run: Run, family: Family, facts: dict[str, Any]) -> Card:
    """The card of a run with the `facts` about its training seed."""
    recipe, problem = run.recipe, find_problem(run.recipe.problem)
    spec = problem.game(problem.config(recipe.preset, recipe.overrides), 1).spec(recipe.role)
    space: spaces.Space[Any] = spec.action_space
    return Card(
        name=recipe.name,
        problem=recipe.problem,
        version=problem.version,
        role=recipe.role,
        algorithm=recipe.algorithm,
        opponent=recipe.opponent or problem.opponents[recipe.preset][other(recipe.role)],
        preset=recipe.preset,
        overrides=dict(recipe.overrides),
        recipe=knobs_of(recipe),
        activation="",
        head="family",
        decentralised=False,
        hold=1,
        observation_size=spec.fields.size,
        actions=count_actions(space),
        best=run.seed,
        seeds={str(run.seed): facts},
        command=run.command,
        versions=versions(),
        family=recipe.family,
        numbers=family.names,
    )
