"""The parts of the chapter that can be asked for, and what each needs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from cps_baselines.hvac.reproduction.experiments import early_onsets, figure, table_cells
from cps_baselines.reproduction.evidence import Experiment
from cps_envs.core.errors import ConfigurationError, near

TABLES, FIGURES = ("4.1", "4.2"), tuple(f"4.{number}fig" for number in range(2, 9))
EARLY, CLAIMS = "early", "claims"
PARTS = (*TABLES, *FIGURES, EARLY, CLAIMS)
QUICK = tuple(part for part in PARTS if part not in ("4.2", "4.8fig", EARLY))


def chosen(parts: Iterable[str], *, quick: bool = False) -> tuple[str, ...]:
    """The parts asked for in their usual order; all of them, or those of QUICK, if none is named.

    Raises:
        ConfigurationError: a part that does not exist.
    """
    wanted = list(parts)
    for part in wanted:
        if part not in PARTS:
            raise ConfigurationError(f"chapter 4 has no part {part!r}. {near(part, PARTS)} Known: {', '.join(PARTS)}.")
    return tuple(part for part in PARTS if part in (wanted or (QUICK if quick else PARTS)))


def needed(parts: Sequence[str], *, quick: bool) -> list[Experiment[Any]]:
    """The experiments behind these parts; some twice. `quick` leaves Table 4.2 and eight sensors out of the claims."""
    wanted = set(parts)
    if CLAIMS in wanted:
        wanted |= {part for part in (*TABLES, *FIGURES) if not quick or part in QUICK}
    todo: list[Experiment[Any]] = []
    for part in PARTS:
        if part in wanted:
            todo += _behind(part)
    return todo


def _behind(part: str) -> list[Experiment[Any]]:
    if part in TABLES:
        return table_cells(part)
    if part in FIGURES:
        return figure(part)
    return early_onsets() if part == EARLY else []
