"""What the chapter solves: cells of the tables, and the controls beside them, with one setting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cps_baselines.fdi.cross import cross, relaxation_mps
from cps_baselines.fdi.grid import GridCell, solve_cell
from cps_baselines.fdi.reproduction.settings import FOUR_VEHICLES, ONE_HORIZON, Settings
from cps_baselines.paper.collisions import CollisionCell, collision_cells
from cps_baselines.reproduction import evidence
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.task import Task

ONE_HORIZON_LIMIT_S = 4.0
ONE_HORIZON_GAP = 0.01


@dataclass(frozen=True)
class Evidence(evidence.Evidence):
    """Results by experiment, solved with one setting."""

    settings: Settings = field(default_factory=Settings)


@dataclass(frozen=True)
class GridRun:
    """A cell of a table by the grid method."""

    settings: Settings
    table: str
    task: Task

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return 0.1 if self.task.sensors.count == 1 else 0.6 * self.settings.time_limit_s

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"Table {self.table}, {self.task.sensors} -> V_{self.task.target}"

    def run(self) -> GridCell:
        """Solve it."""
        settings = self.settings
        config = settings.config(self.table)
        return solve_cell(config, self.task, settings.back_end, settings.time_limit_s, settings.acceptance)


@dataclass(frozen=True)
class OneHorizonRun:
    """The highest impact speed found for a task of four vehicles with the control's one horizon."""

    task: Task

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return 0.6 * ONE_HORIZON_LIMIT_S

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"control with one horizon, {self.task.sensors} -> V_{self.task.target}"

    def run(self) -> float | None:
        """Solve the integer program; m/s, None where no collision was found."""
        return cross(ONE_HORIZON, self.task, ONE_HORIZON_LIMIT_S, ONE_HORIZON_GAP).value_mps


@dataclass(frozen=True)
class RelaxedSpeeds:
    """The highest impact speeds without the resolution, for every task of four vehicles in the tables."""

    config: FdiConfig

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return 3.0

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"linear programs, m = {self.config.horizon}"

    def run(self) -> Mapping[Task, float | None]:
        """Solve the linear programs; m/s, None where no collision can be reached."""
        return {cell.task: relaxation_mps(self.config, cell.task) for cell in four_vehicle_cells()}


def four_vehicle_cells() -> list[CollisionCell]:
    """The cells of Tables 3.1 to 3.6."""
    return [cell for table in FOUR_VEHICLES for cell in collision_cells(table)]
