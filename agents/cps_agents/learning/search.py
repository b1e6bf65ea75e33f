"""Policy search: an evolution strategy chooses the numbers of a family of policies.

Every generation plays new episodes, the same ones for all its candidates. What a run has found is the mean of the
search distribution, which the chance of a generation's episodes moves less than it does the best candidate. Where all
numbers have bounds, a search that has converged begins again elsewhere.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.learning.recipe import UNBOUNDED, Recipe, changed, count_episodes
from cps_agents.learning.run import Report, TrainingJob, recording
from cps_agents.learning.tracking import RunTracker
from cps_baselines.evolution import Evolution
from cps_baselines.family import Family, families, find_family, play_family
from cps_envs.core.declare.seeds import SEEDS_PER_RUN, VALIDATION, training_seed
from cps_envs.core.documents import read_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import FloatArray
from cps_envs.registration import find_problem

REFUSED = -1e9  # what a candidate reaches that the configuration refuses: it disbands a platoon that is not there
CHECKPOINT = "generations.json"  # what every candidate of every generation reached
FOUND = "searched.json"  # the numbers that a run has found, as the packages keep theirs


def play_scenes(recipe: Recipe, family: Family, values: FloatArray, first_seed: int, times: int = 1) -> FloatArray:
    """What each candidate reached, (P, episodes), by its numbers (P, k); the same episodes for all.

    `times` as many episodes of each scene as a candidate is judged by in a search.

    Raises:
        ConfigurationError: the configuration refuses every candidate.
    """
    problem, reached = find_problem(recipe.problem), []
    for scene in recipe.scenes:
        preset, opponent = scene.preset or recipe.preset, scene.opponent or recipe.training.opponent
        overrides = {**recipe.overrides, **scene.overrides}
        played = replace(changed(recipe, {"opponent": opponent}), preset=preset, overrides=overrides)
        episodes = scene.episodes * times
        seeds = [first_seed + episode for episode in range(episodes)] * len(values)
        rows = np.repeat(values, episodes, axis=0)
        outcome = play_family(family, problem, played.venue.config, played.rival, rows, seeds)
        reached.append(recipe.values(outcome).reshape(len(values), episodes))
        first_seed += episodes
    return np.concatenate(reached, axis=1)


def judged(recipe: Recipe, family: Family, values: FloatArray, first_seed: int) -> FloatArray:
    """The mean of what each candidate reached, (P,); `REFUSED` where the configuration takes others, but not that one.

    Raises:
        ConfigurationError: it takes none.
    """
    try:
        found: FloatArray = play_scenes(recipe, family, values, first_seed).mean(axis=1)
    except ConfigurationError:
        found = np.full(len(values), REFUSED)
        for place in range(len(values)):
            with suppress(ConfigurationError):
                found[place] = play_scenes(recipe, family, values[[place]], first_seed).mean()
        if (found == REFUSED).all():
            raise
    return found


def search(job: TrainingJob, report: Report) -> None:
    """Search; see `learner.learn`. A resumed search gives the result of one that was never stopped.

    Raises:
        CommandError: a damaged checkpoint to go on from, or a recipe without a family that fits it.
        MissingExtraError: cma is not installed.
    """
    family = family_of(job.recipe)
    with recording(job) as tracker:
        PolicySearch(job, family, tracker).go_on(report)


def family_of(recipe: Recipe) -> Family:
    """The family that a recipe searches.

    Raises:
        CommandError: it names none, or one of another role.
        UnknownNameError: there is no such family.
    """
    if not recipe.family:
        mine = [name for name, each in families(recipe.problem).items() if each.role == recipe.role]
        known = ", ".join(mine) or "one of your own, MODULE:FAMILY (cps_baselines.family.Family)"
        raise CommandError(f"{recipe.name} names no family of policies to search: add --knob family=NAME, with {known}")
    family = find_family(recipe.family)
    if (family.problem, family.role) != (recipe.problem, recipe.role):
        raise CommandError(
            f"the family {recipe.family} has {family.role}s of {family.problem}; {recipe.name} trains the "
            f"{recipe.role} of {recipe.problem}"
        )
    return family


class PolicySearch:
    """A run of the strategy, brought to where its checkpoint ends."""

    def __init__(self, job: TrainingJob, family: Family, tracker: RunTracker) -> None:
        self.job, self.recipe, self.family, self._tracker = job, job.recipe, family, tracker
        self.episodes = count_episodes(self.recipe.scenes)
        self.generations = max(self.recipe.training.total_timesteps // (self.recipe.population * self.episodes), 1)
        self._starts = 0
        self._evolution = self._started(np.zeros(len(family.numbers)))
        self._cpu_before_s, self._started_s = float(job.read().get("cpu_s", 0.0)), time.process_time()
        self._reached: list[list[float]] = []  # what each generation's candidates reached
        self._replay()

    @property
    def cpu_s(self) -> float:
        """CPU seconds of this run so far."""
        return round(self._cpu_before_s + time.process_time() - self._started_s, 1)

    @property
    def steps(self) -> int:
        """Episodes played to judge candidates so far."""
        return len(self._reached) * self.recipe.population * self.episodes

    @property
    def done(self) -> int:
        """How much of `Recipe.budget` is spent."""
        return self.steps if self.recipe.training.total_timesteps < UNBOUNDED else int(self.cpu_s)

    def go_on(self, report: Report) -> None:
        """Search to the end, with a checkpoint after each generation and validation at equal distances."""
        while len(self._reached) < self.generations and not 0 < self.recipe.most_cpu_s <= self.cpu_s:
            if self._is_due():
                self._validate()
            report(self.done, self._note())
            self._step()
        self._validate()
        if "policy" not in self.job.read():
            play_scenes(self.recipe, self.family, self.values(), VALIDATION[0])  # says why none of them can play
        report(self.done, self._note())

    def _is_due(self) -> bool:
        """Whether it is time for validation."""
        times = max(self.recipe.evaluations, 1)
        if self.recipe.training.total_timesteps < UNBOUNDED:
            return len(self._reached) % max(self.generations // times, 1) == 0
        return self.cpu_s * times >= self.recipe.most_cpu_s * len(list(self.job.evaluations()))

    def values(self) -> FloatArray:
        """The numbers (1, k) in the middle of the search distribution."""
        return self._values_at(self._evolution.mean[np.newaxis])

    def _values_at(self, points: FloatArray) -> FloatArray:
        """The numbers (P, k) at points of the strategy."""
        return self.family.values(points[:, : len(self.family.numbers)])

    def _started(self, origin: FloatArray) -> Evolution:
        """A strategy at an origin, (k,); CMA-ES needs two numbers, of which a second may have no effect."""
        size, deviation, population = len(self.family.numbers), self.recipe.search_deviation, self.recipe.population
        ends = np.array([(number.low, number.high) for number in self.family.numbers]).T.reshape(2, size)
        points, bounds = np.zeros(max(size, 2)), np.full((2, max(size, 2)), np.inf)
        points[:size], bounds[:, :size] = origin, self.family.points(ends)
        bounds[0, size:] = -np.inf
        seed = [self.job.seed, self._starts] if self._starts else [self.job.seed]
        return Evolution(points, deviation, population=population, seed=seed, bounds=bounds)

    def _step(self) -> None:
        """One generation, and the checkpoint that holds it."""
        first = training_seed(self.job.seed) + len(self._reached) * self.episodes % SEEDS_PER_RUN
        reached = self._advance(lambda points: judged(self.recipe, self.family, self._values_at(points), first))
        self._reached.append(reached.tolist())
        write_json(self.job.folder / CHECKPOINT, {"reached": self._reached, "mean": self._evolution.mean.tolist()})
        self.job.write(steps=self.steps, cpu_s=self.cpu_s)
        curves = {"generation/mean": float(reached.mean()), "generation/best": float(reached.max())}
        self._tracker.log({**curves, "generation/deviation": self._evolution.deviation}, self.steps)

    def _advance(self, judge: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """What the candidates of the next generation reached, (P,); it begins elsewhere where nothing new is found."""
        if self._reached and self.family.is_bounded and self._evolution.has_converged:
            self._starts += 1
            shares = np.random.default_rng([self.job.seed, self._starts]).random(len(self.family.numbers))
            low, high = np.array([(number.low, number.high) for number in self.family.numbers]).T
            self._evolution = self._started(self.family.points((low + shares * (high - low))[np.newaxis])[0])
        generation = self._evolution.step(judge)
        assert generation is not None
        return generation.values

    def _replay(self) -> None:
        """Tell the strategy what the checkpoint's generations reached: it draws the same candidates again.

        Raises:
            DamagedFileError: the checkpoint is damaged, or does not fit the recipe.
            CommandError: the strategy draws other candidates than it did.
        """
        path = self.job.folder / CHECKPOINT
        if not path.is_file():
            return
        kept = read_entry(path, "checkpoint of policy search", "Delete the folder and train again.")
        reached = np.array([row.numbers(self.recipe.population) for row in kept["reached"].rows()])
        mean = np.array(kept["mean"].numbers(len(self._evolution.mean)))
        for row in reached:
            self._reached.append(self._advance(lambda points, row=row: row).tolist())  # type: ignore[misc]
        if not np.array_equal(self._evolution.mean, mean):
            raise CommandError(
                f"{path} cannot be continued: another version of cma made it. Install that version, or delete the "
                "folder and train again."
            )

    def _validate(self) -> None:
        """Play validation episodes with the middle of the distribution; if it is the best so far, keep it."""
        rows = list(self.job.evaluations())
        if any(row["steps"] == self.steps for row in rows):
            return
        times = max(self.recipe.evaluation_episodes // self.episodes, 1)
        reached = REFUSED
        with suppress(ConfigurationError):
            reached = float(play_scenes(self.recipe, self.family, self.values(), VALIDATION[0], times).mean())
        if reached > max((float(each["validation"]) for each in rows), default=REFUSED):
            self._keep(reached)
        self.job.append_evaluation({"steps": self.steps, "cpu_s": self.cpu_s, "validation": reached})
        self._tracker.log({"validation/score": reached}, self.steps)

    def _keep(self, validation: float) -> None:
        """Write the middle of the distribution as what has been found, the best so far."""
        values = self.values()[0]
        numbers = dict(zip(self.family.names, values.tolist(), strict=True))
        reference = self.family.reference(values)
        found = {"policy": reference, "command": self.job.command, "seed": self.job.seed, "validation": validation}
        write_json(self.job.folder / FOUND, {self.recipe.name: {**found, "numbers": numbers}})
        self.job.write(best_score=validation, policy=reference)

    def _note(self) -> str:
        scores = [float(row["validation"]) for row in self.job.evaluations()]
        return f"validation {scores[-1]:.4g}, best {max(scores):.4g}, deviation {self._evolution.deviation:.2g}"
