"""What a training run has to do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from agents.learning.recipe import Recipe
from agents.learning.run import Run


@dataclass(frozen=True)
class Job:
    """A recipe, a seed, and where its run goes; plain data that any process can do."""

    recipe: Recipe
    seed: int
    folder: Path
    command: str
    resume: bool = False
    device: str = "cpu"

    @property
    def run(self) -> Run:
        """The run's folder."""
        return Run(self.folder, self.recipe, self.seed, self.command)
