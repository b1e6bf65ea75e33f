"""The controller of `string` as families of policies whose numbers a search chooses."""

from __future__ import annotations

import math

import numpy as np

from baselines.disbanding.string_controller import SHAPE, Gains, StringController
from baselines.disbanding.string_loop import StringLoop
from baselines.disbanding.string_search import START, STEP
from baselines.family import Family, Number
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.problem import DISBANDING

VEHICLES = ("leader", "other")
BROADCAST_ONLY = ("ahead_closing", "ahead_acceleration", "ahead_command")
AGE = "forgetting"  # of no use where what is known is never old
DETECTION = Number("detection_mps", 0.3, 1.0, by_factors=True)  # chosen: small, as nothing acts before an attack


def _gains(*unused: str) -> tuple[Number, ...]:
    """The numbers of both classes of vehicles, but for the unused ones."""
    return tuple(
        Number(f"{vehicle}.{name}", getattr(START, name), getattr(STEP, name))
        for vehicle in VEHICLES
        for name in Gains._fields
        if name not in unused
    )


def _table(numbers: tuple[Number, ...], values: FloatArray) -> FloatArray:
    """The gains (B, 2, 16) of values (B, k); gains without a number are zero."""
    gains = np.zeros((len(values), *SHAPE))
    places = {f"{v}.{name}": (i, j) for i, v in enumerate(VEHICLES) for j, name in enumerate(Gains._fields)}
    for column, number in enumerate(numbers):
        if number.name in places:
            gains[(slice(None), *places[number.name])] = values[:, column]
    return gains


def _broadcast(spec: RoleSpec, values: FloatArray) -> StringController:
    return StringController(spec, form="informed", gains=_table(BROADCAST.numbers, values), detection_mps=math.inf)


def _local(spec: RoleSpec, values: FloatArray) -> StringController:
    gains = _table(LOCAL.numbers, values)
    return StringController(spec, form="local", gains=gains, detection_mps=values[:, -1])


def _broadcast_loop(config: DisbandingConfig, num_envs: int, values: FloatArray) -> StringLoop:
    return StringLoop(config, num_envs, _broadcast(DISBANDING.game(config, 1).spec("defender"), values))


def _local_loop(config: DisbandingConfig, num_envs: int, values: FloatArray) -> StringLoop:
    return StringLoop(config, num_envs, _local(DISBANDING.game(config, 1).spec("defender"), values))


# Acts on a warning that is never lost or old, as that of the dissertation.
BROADCAST = Family("disbanding", "defender", _gains(AGE), _broadcast, _broadcast_loop)
# Acts on its own detection; each vehicle knows itself and its predecessor.
LOCAL = Family("disbanding", "defender", (*_gains(AGE, *BROADCAST_ONLY), DETECTION), _local, _local_loop)
