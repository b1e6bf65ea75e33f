"""Families of defenders of a string: a searched controller, whose numbers stay, and a bounded network beside it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cps_baselines.disbanding import families
from cps_baselines.disbanding.residual import SIGNALS
from cps_baselines.disbanding.string_controller import StringController, StringLoop
from cps_baselines.family import Family, Number
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.problem import DISBANDING

UNITS = 8
STEP = 0.3
SPREAD = 0.5  # deviation of the weights at the start, drawn once; the network adds nothing then
COUNTS = "counts"  # the name of what a unit counts in the sum


def _units() -> tuple[Number, ...]:
    """The numbers of the network, unit by unit, in the order of `residual`."""
    drawn = SPREAD * np.random.default_rng(0).standard_normal((UNITS, len(SIGNALS) + 1))
    return tuple(
        Number(f"unit_{unit + 1}.{name}", start, STEP)
        for unit, starts in enumerate(drawn.tolist())
        for name, start in zip((*SIGNALS, "bias", COUNTS), (*starts, 0.0), strict=True)
    )


def _beside(base: Family, form: str, detection_mps: float) -> Family:
    """The controllers of a family with a network beside each."""
    count = len(base.numbers)

    def build(spec: RoleSpec, values: FloatArray) -> StringController:
        gains = families.table(base.numbers, values[:, :count])
        return StringController(spec, form=form, gains=gains, detection_mps=detection_mps, weights=values[:, count:])

    def loop(config: DisbandingConfig, num_envs: int, values: FloatArray) -> StringLoop:
        policy = build(DISBANDING.game(config, 1).spec("defender"), values)
        return StringLoop(config, num_envs, policy)

    kept = tuple(replace(number, step=0.0) for number in base.numbers)
    return Family(base.problem, base.role, (*kept, *_units()), build, loop)


BROADCAST = _beside(families.BROADCAST, "informed", math.inf)
LOCAL = _beside(families.LOCAL, "local", families.ALWAYS)
