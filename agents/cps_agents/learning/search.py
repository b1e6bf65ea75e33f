"""Policy search: an evolution strategy chooses the numbers of a family of policies.

Every generation plays new episodes, the same ones for all its candidates. What a run has found is the mean of the
search distribution, which the chance of a generation's episodes moves less than it does the best candidate.
"""

from __future__ import annotations

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.learning.family_run import FamilyRun, family_of, play_scenes
from cps_agents.learning.learner import Report
from cps_agents.learning.run import Job, recording
from cps_agents.learning.tracking import Tracker
from cps_baselines.family import Family
from cps_envs.core.documents import read_entry
from cps_envs.core.errors import require
from cps_envs.core.types import FloatArray

CHECKPOINT = "generations.json"  # what every candidate of every generation reached


def search(job: Job, report: Report) -> None:
    """Search; see `learner.learn`. A resumed search gives the result of one that was never stopped.

    Raises:
        CommandError: a damaged checkpoint to go on from, or a recipe without a family that fits it.
        MissingExtraError: cma is not installed.
    """
    require("cma", extra="baselines", purpose="policy search")
    family = family_of(job.recipe, job.seed)
    with recording(job) as tracker:
        Search(job, family, tracker).go_on(report)


class Search(FamilyRun):
    """A run of the strategy, an update of which is a generation."""

    def __init__(self, job: Job, family: Family, tracker: Tracker) -> None:
        from cps_baselines.evolution import make_strategy

        self.candidates = job.recipe.population
        super().__init__(job, family, tracker)
        origin, deviation = np.zeros(self.family.free.sum()), self.recipe.search_deviation
        self._strategy = make_strategy(origin, deviation, population=self.candidates, seed=[job.seed])
        self._reached = self._replay()
        self.done = len(self._reached)

    @property
    def point(self) -> FloatArray:
        """The middle of the search distribution."""
        middle: FloatArray = self._strategy.mean
        return middle

    def note(self) -> str:
        """How wide the distribution is."""
        return f"deviation {self._strategy.sigma:.2g}"

    def update(self, first_seed: int) -> dict[str, float]:
        """One generation."""
        points = self._strategy.ask()
        values = self.family.values(np.array(points))
        reached = play_scenes(self.recipe, self.family, values, first_seed).mean(axis=1)
        self._strategy.tell(points, (-reached).tolist())
        self._reached.append(reached.tolist())
        self.done = len(self._reached)
        write_json(self.run.folder / CHECKPOINT, {"reached": self._reached, "mean": self._strategy.mean.tolist()})
        curves = {"generation/mean": float(reached.mean()), "generation/best": float(reached.max())}
        return {**curves, "generation/deviation": float(self._strategy.sigma)}

    def _replay(self) -> list[list[float]]:
        """Tell the strategy what the checkpoint's generations reached: it draws the same candidates again.

        Raises:
            DamagedFileError: the checkpoint is damaged, or does not fit the recipe.
            CommandError: the strategy draws other candidates than it did.
        """
        path = self.run.folder / CHECKPOINT
        if not path.is_file():
            return []
        kept = read_entry(path, "checkpoint of policy search", "Delete the folder and train again.")
        reached = np.array([row.numbers(self.candidates) for row in kept["reached"].rows()])
        mean = np.array(kept["mean"].numbers(len(self.point)))
        for row in reached:
            self._strategy.tell(self._strategy.ask(), (-row).tolist())
        if not np.array_equal(self._strategy.mean, mean):
            raise CommandError(
                f"{path} cannot be continued: another version of cma made it. Install that version, or delete the "
                "folder and train again."
            )
        rows: list[list[float]] = reached.tolist()
        return rows
