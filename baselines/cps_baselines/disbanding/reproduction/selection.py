"""The parts of the chapter that can be asked for, and what each needs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from cps_baselines.disbanding.reproduction.experiments import Experiments
from cps_baselines.reproduction.evidence import Experiment
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.disbanding.config import INTERPRETATIONS

PARTS = {
    "2.2": "Table 2.2: one platoon disbanded",
    "2.3": "Table 2.3: two platoons disbanded",
    "2.1fig": "Fig. 2.1: strings of 20, 50 and 80 platoons",
    "2.3fig": "Fig. 2.3: optimal attacks",
    "platoons": "every defender against N = 2 to 10 platoons",
    "text": "what the text describes and the tables leave out, with comfort, energy and recovery",
    "ga": "the genetic algorithm that solves (2.9)",
    "claims": "everything that the text claims, one by one",
}
PLAYED = ("platoons", "text")  # left out by --quick


def chosen(parts: Iterable[str], *, quick: bool = False) -> tuple[str, ...]:
    """The parts asked for in their usual order; if none is named all of them, with `quick` without the played ones.

    Raises:
        ConfigurationError: a part that does not exist.
    """
    wanted = list(parts)
    for part in wanted:
        if part not in PARTS:
            raise ConfigurationError(f"chapter 2 has no part {part!r}. {near(part, PARTS)} Known: {', '.join(PARTS)}.")
    usual = [part for part in PARTS if not (quick and part in PLAYED)]
    return tuple(part for part in PARTS if part in (wanted or usual))


def needed(
    parts: Sequence[str], interpretation: str, *, quick: bool, all_interpretations: bool
) -> list[Experiment[Any]]:
    """The experiments behind these parts; some twice.

    `quick` leaves out strings of 50 and 80 platoons, grids of alternative attacks, and all but one search.
    """
    experiments = Experiments(interpretation)
    todo: list[Experiment[Any]] = []
    for part in parts:
        if part in ("2.2", "2.3"):
            todo += experiments.table(part)
        if part == "2.1fig":
            todo += experiments.figure_2_1(quick=quick)
        if part == "2.3fig":
            todo += experiments.figure_2_3()
        if part == "platoons":
            todo += experiments.platoons()
        if part == "text":
            todo += experiments.readings()
        if part == "ga":
            todo += experiments.searches(quick=quick)
            todo += experiments.paper_plans()
            todo += [] if quick else experiments.two_platoons()
        if part == "claims":
            todo += [*experiments.table("2.2"), *experiments.table("2.3")]
            todo += [*experiments.figure_2_1(quick=quick), *experiments.figure_2_3()]
            todo += [] if quick else [*experiments.one_platoon(), *experiments.two_platoons()]
    if all_interpretations:
        for name in INTERPRETATIONS:
            todo += [each for table in ("2.2", "2.3") for each in Experiments(name).table(table, ("baseline",))]
    return todo
