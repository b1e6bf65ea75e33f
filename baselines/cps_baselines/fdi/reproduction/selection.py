"""The parts of the chapter that can be asked for, and what each needs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from cps_baselines.fdi.reproduction.cells import grid_runs
from cps_baselines.fdi.reproduction.experiments import OneHorizonRun, RelaxedSpeeds, four_vehicle_cells
from cps_baselines.fdi.reproduction.settings import FOUR_VEHICLES, ONE_HORIZON, RELAXED, TABLES, Settings
from cps_baselines.fdi.reproduction.variants import figure_runs
from cps_baselines.reproduction.evidence import Experiment
from cps_envs.core.errors import ConfigurationError, near

FIGURE, AUDIT = "fig", "audit"
PARTS = (*TABLES, FIGURE, AUDIT)
QUICK = ("3.1", "3.2", "3.5", FIGURE, AUDIT)  # the tables with one attacked vehicle


def chosen(parts: Iterable[str], *, quick: bool = False) -> tuple[str, ...]:
    """The parts asked for in their usual order; all of them, or those of QUICK, if none is named.

    Raises:
        ConfigurationError: a part that does not exist.
    """
    wanted = list(parts)
    for part in wanted:
        if part not in PARTS:
            raise ConfigurationError(f"chapter 3 has no part {part!r}. {near(part, PARTS)} Known: {', '.join(PARTS)}.")
    default = QUICK if quick else PARTS
    return tuple(part for part in PARTS if part in (wanted or default))


def needed(parts: Sequence[str], settings: Settings, *, quick: bool) -> list[Experiment[Any]]:
    """The experiments behind these parts; some twice. `quick` leaves out the control with one horizon."""
    todo: list[Experiment[Any]] = []
    for table in tables_of(parts):
        todo += grid_runs(settings, table)
        if table in FOUR_VEHICLES:
            todo.append(RelaxedSpeeds(RELAXED))
            todo += [] if quick else [OneHorizonRun(cell.task) for cell in four_vehicle_cells() if cell.table == table]
    if FIGURE in parts:
        todo += figure_runs()
    if AUDIT in parts:
        todo.append(RelaxedSpeeds(ONE_HORIZON))
    return todo


def tables_of(parts: Iterable[str]) -> list[str]:
    """The tables among the parts."""
    return [part for part in parts if part in TABLES]
