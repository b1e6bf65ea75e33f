"""Policy search: an evolution strategy chooses the numbers of a family of policies.

Every generation plays new episodes, the same ones for all its candidates. What a run has found is the mean of the
search distribution, which the chance of a generation's episodes moves less than it does the best candidate.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.learning.recipe import Recipe, count_episodes, knobs_of
from cps_agents.learning.run import Report, TrainingJob, recording
from cps_agents.learning.tracking import RunTracker
from cps_agents.zoo.card import Card
from cps_agents.zoo.files import save
from cps_agents.zoo.numbers import NamedNumbers, card_of_numbers
from cps_baselines.evolution import Evolution
from cps_baselines.family import Family, families, find_family, play_family
from cps_envs.core.declare.seeds import SEEDS_PER_RUN, VALIDATION, training_seed
from cps_envs.core.documents import read_entry
from cps_envs.core.types import FloatArray
from cps_envs.registration import find_problem


def play_scenes(recipe: Recipe, family: Family, values: FloatArray, first_seed: int, times: int = 1) -> FloatArray:
    """What each candidate reached, (P, episodes), by its numbers (P, k); the same episodes for all.

    `times` as many episodes of each scene as a candidate is judged by in a search.
    """
    problem, reached = find_problem(recipe.problem), []
    for scene in recipe.scenes:
        preset, opponent = scene.preset or recipe.preset, scene.opponent or recipe.opponent
        overrides = {**recipe.overrides, **scene.overrides}
        played = replace(recipe, preset=preset, opponent=opponent, overrides=overrides)
        episodes = scene.episodes * times
        seeds = [first_seed + episode for episode in range(episodes)] * len(values)
        rows = np.repeat(values, episodes, axis=0)
        outcome = play_family(family, problem, played.venue.config, played.rival, rows, seeds)
        reached.append(recipe.values(outcome).reshape(len(values), episodes))
        first_seed += episodes
    return np.concatenate(reached, axis=1)


CHECKPOINT = "generations.json"  # what every candidate of every generation reached


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
        known = ", ".join(families(recipe.problem)) or "one of your own, MODULE:FAMILY (cps_baselines.family.Family)"
        raise CommandError(
            f"{recipe.name} names no family of policies to search: add --knob family=NAME, with {known}. "
            "The SEARCHES of a problem are for `cps-envs best-response --oracle search`"
        )
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
        self.generations = max(self.recipe.total_steps // (self.recipe.population * self.episodes), 1)
        origin = np.zeros(len(family.numbers))
        deviation, population = self.recipe.search_deviation, self.recipe.population
        self._evolution = Evolution(origin, deviation, population=population, seed=[job.seed])
        self._cpu_before_s, self._started_s = float(job.read().get("cpu_s", 0.0)), time.process_time()
        self._reached = self._replay()

    @property
    def cpu_s(self) -> float:
        """CPU seconds of this run so far."""
        return round(self._cpu_before_s + time.process_time() - self._started_s, 1)

    @property
    def steps(self) -> int:
        """Episodes played to judge candidates so far."""
        return len(self._reached) * self.recipe.population * self.episodes

    def go_on(self, report: Report) -> None:
        """Search to the end, with a checkpoint after each generation and validation at equal distances."""
        distance = max(self.generations // max(self.recipe.evaluations, 1), 1)
        while len(self._reached) < self.generations and not 0 < self.recipe.most_cpu_s <= self.cpu_s:
            if len(self._reached) % distance == 0:
                self._validate()
            report(self.steps, self._note())
            self._step()
        self._validate()
        report(self.steps, self._note())

    def values(self) -> FloatArray:
        """The numbers (1, k) in the middle of the search distribution."""
        return self.family.values(self._evolution.mean[np.newaxis])

    def _step(self) -> None:
        """One generation, and the checkpoint that holds it."""
        first = training_seed(self.job.seed) + len(self._reached) * self.episodes % SEEDS_PER_RUN

        def judge(points: FloatArray) -> FloatArray:
            found: FloatArray = play_scenes(self.recipe, self.family, self.family.values(points), first).mean(axis=1)
            return found

        generation = self._evolution.step(judge)
        assert generation is not None
        reached = generation.values
        self._reached.append(reached.tolist())
        write_json(self.job.folder / CHECKPOINT, {"reached": self._reached, "mean": self._evolution.mean.tolist()})
        self.job.write(steps=self.steps, cpu_s=self.cpu_s)
        curves = {"generation/mean": float(reached.mean()), "generation/best": float(reached.max())}
        self._tracker.log({**curves, "generation/deviation": self._evolution.deviation}, self.steps)

    def _replay(self) -> list[list[float]]:
        """Tell the strategy what the checkpoint's generations reached: it draws the same candidates again.

        Raises:
            DamagedFileError: the checkpoint is damaged, or does not fit the recipe.
            CommandError: the strategy draws other candidates than it did.
        """
        path = self.job.folder / CHECKPOINT
        if not path.is_file():
            return []
        kept = read_entry(path, "checkpoint of policy search", "Delete the folder and train again.")
        reached = np.array([row.numbers(self.recipe.population) for row in kept["reached"].rows()])
        mean = np.array(kept["mean"].numbers(len(self._evolution.mean)))
        for row in reached:
            self._evolution.step(lambda points, row=row: row)  # type: ignore[misc]
        if not np.array_equal(self._evolution.mean, mean):
            raise CommandError(
                f"{path} cannot be continued: another version of cma made it. Install that version, or delete the "
                "folder and train again."
            )
        rows: list[list[float]] = reached.tolist()
        return rows

    def _validate(self) -> None:
        """Play validation episodes with the middle of the distribution; if it is the best so far, keep it."""
        rows = list(self.job.evaluations())
        if any(row["steps"] == self.steps for row in rows):
            return
        times = max(self.recipe.evaluation_episodes // self.episodes, 1)
        reached = float(play_scenes(self.recipe, self.family, self.values(), VALIDATION[0], times).mean())
        row = {"steps": self.steps, "cpu_s": self.cpu_s, "validation": reached}
        if row["validation"] > max((float(each["validation"]) for each in rows), default=-np.inf):
            numbers = NamedNumbers(self.values()[0])
            save(self.job.card, make_card(self.job, self.family, row), {self.job.seed: numbers})
            self.job.write(best_score=row["validation"])
        self.job.append_evaluation(row)
        self._tracker.log({"validation/score": row["validation"]}, self.steps)

    def _note(self) -> str:
        scores = [float(row["validation"]) for row in self.job.evaluations()]
        return f"validation {scores[-1]:.4g}, best {max(scores):.4g}, deviation {self._evolution.deviation:.2g}"


def make_card(job: TrainingJob, family: Family, facts: dict[str, Any]) -> Card:
    """The card of a search with the `facts` about its training seed."""
    recipe = job.recipe
    return card_of_numbers(
        recipe.venue,
        recipe.role,
        name=recipe.name,
        algorithm=recipe.algorithm,
        opponent=recipe.rival,
        recipe=knobs_of(recipe),
        head="family",
        best=job.seed,
        seeds={str(job.seed): facts},
        command=job.command,
        family=recipe.family,
        numbers=family.names,
    )
