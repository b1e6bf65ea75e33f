"""Descent: gradients through whole episodes move the numbers of a family of policies that can tell them.

The steps are those of Adam (Kingma and Ba 2015). An episode that happens to lie beside a jump has a gradient far longer
than the others: it counts at most a few times as much as the middle one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.learning.family_run import FamilyRun, episodes_of, family_of
from cps_agents.learning.learner import Report
from cps_agents.learning.run import Job, recording
from cps_agents.learning.tracking import Tracker
from cps_baselines.family import Family
from cps_envs.core.documents import read_entry
from cps_envs.core.types import FloatArray

CHECKPOINT = "descent.json"
LONGEST = 10.0  # times the middle length of the gradients
MEAN_DECAY, SQUARE_DECAY, LEAST = 0.9, 0.97, 1e-6  # a run has a few hundred updates, so it remembers less than usual


class Adam(NamedTuple):
    """Where the descent is, (f,) each."""

    point: FloatArray
    mean: FloatArray  # of the gradients, decaying
    square: FloatArray  # of their squares

    def moved(self, gradient: FloatArray, rate: float, updates: int) -> Adam:
        """One step upward; `updates` counts it."""
        mean = MEAN_DECAY * self.mean + (1.0 - MEAN_DECAY) * gradient
        square = SQUARE_DECAY * self.square + (1.0 - SQUARE_DECAY) * gradient * gradient
        direction = mean / (1.0 - MEAN_DECAY**updates)
        size = np.sqrt(square / (1.0 - SQUARE_DECAY**updates)) + LEAST
        return Adam(self.point + rate * direction / size, mean, square)


def descend(job: Job, report: Report) -> None:
    """Descend; see `learner.learn`. A resumed run gives the result of one that was never stopped.

    Raises:
        CommandError: a damaged checkpoint to go on from, or a recipe without a family that has gradients.
    """
    family = family_of(job.recipe, job.seed)
    if family.gradients is None:
        raise CommandError(f"the family {job.recipe.family} has no gradients: search it with --algo cma-es")
    with recording(job) as tracker:
        Descent(job, family, tracker).go_on(report)


def shortened(gradients: FloatArray) -> FloatArray:
    """The mean (f,) of gradients (episodes, f), of which none is much longer than the middle one."""
    lengths = np.linalg.norm(gradients, axis=1, keepdims=True)
    longest = LONGEST * np.median(lengths)
    mean: FloatArray = (gradients * np.minimum(1.0, longest / np.maximum(lengths, LEAST))).mean(axis=0)
    return mean


class Descent(FamilyRun):
    """A run of Adam, an update of which is one step."""

    candidates = 1

    def __init__(self, job: Job, family: Family, tracker: Tracker) -> None:
        super().__init__(job, family, tracker)
        self._adam = self._kept()

    @property
    def point(self) -> FloatArray:
        """Where the descent is."""
        return self._adam.point

    def note(self) -> str:
        """How far it has gone."""
        return f"distance {np.linalg.norm(self.point):.2g}"

    def update(self, first_seed: int) -> dict[str, float]:
        """One step along the mean gradient of the scenes; its length falls linearly, see `final_learning_rate`."""
        recipe, gradients, reached = self.recipe, [], []
        assert self.family.gradients is not None
        for config, opponent, seeds in episodes_of(recipe, first_seed):
            values = np.repeat(self.values(), len(seeds), axis=0)
            outcome, found = self.family.gradients(config, values, opponent, seeds, recipe.slopes)
            gradients.append(self.family.by_steps(values, found))
            reached.append(recipe.values(outcome))
        rate = recipe.learning_rate + self.done / self.updates * (recipe.final_learning_rate - recipe.learning_rate)
        self.done += 1
        self._adam = self._adam.moved(shortened(np.concatenate(gradients)), rate, self.done)
        state = {name: each.tolist() for name, each in self._adam._asdict().items()}
        write_json(self.run.folder / CHECKPOINT, {"updates": self.done, **state})
        return {"update/mean": float(np.concatenate(reached).mean()), "update/learning_rate": rate}

    def _kept(self) -> Adam:
        """What the checkpoint says, or the start.

        Raises:
            DamagedFileError: the checkpoint is damaged, or does not fit the recipe.
        """
        path, size = self.run.folder / CHECKPOINT, int(self.family.free.sum())
        if not path.is_file():
            return Adam(*np.zeros((3, size)))
        kept = read_entry(path, "checkpoint of a descent", "Delete the folder and train again.")
        self.done = kept["updates"].whole(0, self.updates)
        return Adam(*(np.array(kept[name].numbers(size)) for name in Adam._fields))
