"""What the chapter computes: whether the targets of its tables can be hit, with one setting, and linear programs."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

from cps_baselines.fdi.cross import relaxation_mps
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.fdi.config import A, FdiConfig
from cps_envs.fdi.optima import Record, known
from cps_envs.fdi.task import Task
from cps_paper.evidence import Evidence
from cps_paper.fdi.grid import GridEnd, reach
from cps_paper.fdi.interpretations import B, C
from cps_paper.printed.tables import TABLE_VEHICLES, CollisionCell, collision_cells

TABLES = tuple(TABLE_VEHICLES)
FOUR_VEHICLES = tuple(table for table, vehicles in TABLE_VEHICLES.items() if vehicles == 4)
ALL_FOUR = "n = 4"  # all of these together
SETS: Mapping[str, FdiConfig] = {"A": A, "B": B}
FITTED: Mapping[str, int] = dict(zip(TABLES, (14, 20, 25, 18, 14, 10, 12), strict=True))  # m that agree best, set A
ONE_HORIZON = A  # m = 20, as in the game
RELAXED = C  # the control by linear programs, m = 25


@dataclass(frozen=True)
class FdiSettings:
    """How the cells are judged.

    Raises:
        ConfigurationError: an unknown set, or a limit that is not above 0.
    """

    parameters: str = "A"
    nodes: int = 100  # of each search
    acceptance: float = 0.45  # largest distance of the end from a point of the grid

    def __post_init__(self) -> None:
        if self.parameters not in SETS:
            raise ConfigurationError(f"there is no preset set {self.parameters!r}. {near(self.parameters, SETS)}")
        if not (self.nodes > 0 and self.acceptance > 0):
            raise ConfigurationError(
                f"nodes and acceptance have to be above 0; got {self.nodes} and {self.acceptance:g}."
            )

    def config(self, table: str) -> FdiConfig:
        """The platoon of a table, with the one horizon of its set."""
        return replace(SETS[self.parameters], num_vehicles=TABLE_VEHICLES[table])

    def certificates(self, table: str) -> Mapping[Task, Record]:
        """What is certified of a table's tasks; empty where nothing ships."""
        return known(self.config(table))

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables of this set: those with certificates."""
        return tuple(table for table in TABLES if self.certificates(table))

    @property
    def has_reference(self) -> bool:
        """Whether the counts of the regression check are those of these settings."""
        return self == FdiSettings(self.parameters)


@dataclass(frozen=True)
class FdiEvidence(Evidence):
    """Results by experiment, computed with one setting."""

    settings: FdiSettings = field(default_factory=FdiSettings)


@dataclass(frozen=True)
class CircleRun:
    """Whether the target of a cell can be hit: a search in the acceptance circle, from the certificate's plan."""

    settings: FdiSettings
    table: str
    task: Task
    fitted: bool = False  # at the table's fitted horizon, to which no plan belongs

    @property
    def cost(self) -> float:
        """How long it takes, in seconds."""
        return 0.05 if self.task.sensors.count == 1 else 0.3

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"Table {self.table}, {self.task.sensors} -> V_{self.task.target}"

    def run(self) -> GridEnd:
        """Search for it."""
        settings, config = self.settings, self.settings.config(self.table)
        plan = settings.certificates(self.table)[self.task].injections
        if self.fitted:
            config, plan = replace(config, horizon=FITTED[self.table]), None
        return reach(config, self.task, settings.acceptance, settings.nodes, plan)


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
