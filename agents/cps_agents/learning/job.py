"""What a training run has to do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cps_agents.learning.knobs import knobs_of
from cps_agents.learning.recipe import Recipe
from cps_agents.learning.run import Run
from cps_agents.learning.tracking import Subject


@dataclass(frozen=True)
class Job:
    """A recipe, a seed, and where its run goes; plain data that any process can do."""

    recipe: Recipe
    seed: int
    folder: Path
    command: str
    resume: bool = False
    device: str = "cpu"
    tracker: str = "tensorboard"

    @property
    def run(self) -> Run:
        """The run's folder."""
        return Run(self.folder, self.recipe, self.seed, self.command)

    @property
    def subject(self) -> Subject:
        """What a tracker is told of it."""
        return Subject(f"{self.recipe.name}-seed-{self.seed}", self.recipe.name, self.folder, knobs_of(self.recipe))
