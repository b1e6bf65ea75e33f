"""The conditions under which chapter 5 is judged again: half the integration step, and worlds that differ slightly."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

from cps_baselines.reproduction.evidence import Experiment
from cps_baselines.reproduction.recheck import Condition
from cps_baselines.rogue.reproduction.experiments import Overrides, Ride, Waves
from cps_baselines.rogue.switching_search import SPREAD
from cps_envs.rogue.config import PAPER

WORLDS = 20
HALF_STEP: Overrides = (("dt_s", PAPER.dt_s / 2),)
OTHER_WORLDS: Overrides = tuple(
    (name, (value * (1 - SPREAD), value * (1 + SPREAD)))
    for name, value in (("drive_mps2", float(PAPER.drive_mps2)), ("drag_per_s", float(PAPER.drag_per_s)))  # type: ignore[arg-type]
)


def _varied(experiment: Experiment[Any], overrides: Overrides, seed: int = 0) -> Experiment[Any]:
    """The same course or the same damages under other settings."""
    if not isinstance(experiment, Ride | Waves):
        raise TypeError(f"no claim needs {experiment.label}")
    return replace(experiment, overrides=(*experiment.overrides, *overrides), seed=seed)


CONDITIONS = (
    Condition(f"at half the step ({1e3 * PAPER.dt_s / 2:g} ms)", (partial(_varied, overrides=HALF_STEP),)),
    Condition(
        f"in {WORLDS} worlds (drive and drag within {100 * SPREAD:g} %)",
        tuple(partial(_varied, overrides=OTHER_WORLDS, seed=seed) for seed in range(1, WORLDS + 1)),
    ),
)
