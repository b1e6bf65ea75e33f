"""What the chapter solves: cells of the tables, and the controls beside them, with one setting."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

from cps_baselines.fdi.cross import cross, relaxation_mps
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.fdi.config import A, FdiConfig
from cps_envs.fdi.task import Task
from cps_paper.evidence import Evidence
from cps_paper.fdi.grid import GridCell, solve_cell
from cps_paper.fdi.interpretations import B, C
from cps_paper.printed.tables import TABLE_VEHICLES, CollisionCell, collision_cells

TABLES = tuple(TABLE_VEHICLES)
FOUR_VEHICLES = tuple(table for table, vehicles in TABLE_VEHICLES.items() if vehicles == 4)
ALL_FOUR = "n = 4"  # all of these together
SETS: Mapping[str, FdiConfig] = {"A": A, "B": B}
HORIZONS: Mapping[str, Mapping[str, int]] = {  # m, fitted per table: the paper prints none
    "A": dict(zip(TABLES, (14, 20, 25, 18, 14, 10, 12), strict=True)),
    "B": dict(zip(TABLES, (15, 15, 25, 15, 15, 11, 12), strict=True)),
}
ONE_HORIZON = A  # the control with a single horizon, m = 20
RELAXED = C  # the control by linear programs, m = 25


@dataclass(frozen=True)
class FdiSettings:
    """How the cells are solved.

    Raises:
        ConfigurationError: an unknown set, or a limit that is not above 0.
    """

    parameters: str = "A"
    time_limit_s: float = 2.0  # of each solve
    acceptance: float = 0.45  # largest distance of the end from the goal

    def __post_init__(self) -> None:
        if self.parameters not in SETS:
            raise ConfigurationError(f"there is no preset set {self.parameters!r}. {near(self.parameters, SETS)}")
        if not (self.time_limit_s > 0 and self.acceptance > 0):
            raise ConfigurationError(
                f"time limit and acceptance have to be above 0; got {self.time_limit_s:g} s and {self.acceptance:g}."
            )

    def config(self, table: str) -> FdiConfig:
        """The platoon and the horizon of a table."""
        return replace(
            SETS[self.parameters], num_vehicles=TABLE_VEHICLES[table], horizon=HORIZONS[self.parameters][table]
        )

    @property
    def has_goals(self) -> bool:
        """Whether the goals of the specification were stated for these: 2 s or more, 0.45."""
        default = FdiSettings(self.parameters)
        return self.time_limit_s >= default.time_limit_s and self.acceptance == default.acceptance


ONE_HORIZON_LIMIT_S = 4.0
ONE_HORIZON_GAP = 0.01


@dataclass(frozen=True)
class FdiEvidence(Evidence):
    """Results by experiment, solved with one setting."""

    settings: FdiSettings = field(default_factory=FdiSettings)


@dataclass(frozen=True)
class GridRun:
    """A cell of a table by the grid method."""

    settings: FdiSettings
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
        return solve_cell(config, self.task, settings.time_limit_s, settings.acceptance)


@dataclass(frozen=True)
class OneHorizonRun:
    """The highest impact speed found for a task of four vehicles with the control's one horizon."""

    task: Task

    cost: ClassVar[float] = 0.6 * ONE_HORIZON_LIMIT_S  # s

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

    cost: ClassVar[float] = 3.0  # s

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


def with_total(tables: Collection[str]) -> Iterator[tuple[str, Sequence[str]]]:
    """Rows of these tables: each alone, and after 3.6 all tables with four vehicles together if all are there."""
    for table in tables:
        yield table, (table,)
        if table == FOUR_VEHICLES[-1] and set(FOUR_VEHICLES) <= set(tables):
            yield ALL_FOUR, FOUR_VEHICLES
