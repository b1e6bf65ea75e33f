"""What a reproduction of chapter 3 is run with: parameter set, horizons, solver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cps_baselines.paper.collisions import TABLE_VEHICLES
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.fdi.config import A, B, C, FdiConfig

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
BACK_ENDS = ("highs", "scip", "cplex")


@dataclass(frozen=True)
class Settings:
    """How the cells are solved.

    Raises:
        ConfigurationError: an unknown set or back end, or a limit that is not above 0.
    """

    parameters: str = "A"
    back_end: str = "highs"
    time_limit_s: float = 2.0  # of each solve
    acceptance: float = 0.45  # largest distance of the end from the goal

    def __post_init__(self) -> None:
        for kind, name, known in (
            ("preset set", self.parameters, tuple(SETS)),
            ("back end", self.back_end, BACK_ENDS),
        ):
            if name not in known:
                raise ConfigurationError(f"there is no {kind} {name!r}. {near(name, known)}")
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
        """Whether the goals of the specification were stated for this solver: highs, 2 s or more, 0.45."""
        default = Settings(self.parameters)
        return (
            self.back_end == default.back_end
            and self.time_limit_s >= default.time_limit_s
            and self.acceptance == default.acceptance
        )
