"""What attackers can do in the setting of the learning problem: square waves, other duties, closed loop."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from cps_baselines.rogue.reproduction.evidence import Evidence, steady_waves
from cps_baselines.rogue.reproduction.experiments import ClosedLoop, Ride, Waves
from cps_baselines.rogue.reproduction.settings import LEARNING_S, MAPS, SOLID
from cps_baselines.rogue.reproduction.shipped import shipped_rows
from cps_baselines.rogue.switching_search import ALL, RATIOS
from cps_envs.core.types import FloatArray

DUTY_HZ = tuple(np.round(np.geomspace(0.01, 0.6, 18), 4).tolist())
DUTIES = tuple(np.round(np.linspace(0.45, 0.95, 11), 2).tolist())
GENERAL_RIDE = Ride("switching", "sliding_detection", contact=SOLID, duration_s=LEARNING_S)


@dataclass(frozen=True)
class HeadRoom:
    """The largest damages in m/s that kinds of attackers do to a defender; contact `SOLID`, 60 s."""

    defender: str
    power_ratio: float
    throttle: float  # full all the time
    square: float  # best of STEADY_HZ
    duty: float  # best of DUTY_HZ x DUTIES
    best_wave: tuple[float, float]  # its frequency in Hz and duty
    closed: float  # searched against this defender
    verified: float  # the same, mean over perturbed worlds at half the step
    general: float  # searched against all defenders, verified in the same way

    @property
    def other(self) -> dict[str, float]:
        """What an independent implementation found."""
        rows = {(row["defender"], float(row["power_ratio"])): row for row in shipped_rows("headroom")}
        row = rows[self.defender, self.power_ratio]
        return {name: float(row[name]) for name in ("square", "duty", "closed", "verified")}


def duty_waves(defender: str, power_ratio: float) -> Waves:
    """Square waves of many frequencies and duties."""
    return Waves(defender, power_ratio, tuple(product(DUTY_HZ, DUTIES)), SOLID, LEARNING_S)


def head_room_experiments() -> list[Any]:
    """Everything behind the table."""
    return [GENERAL_RIDE] + [
        each
        for defender, ratio in product(MAPS.values(), RATIOS)
        for each in (
            steady_waves(defender, SOLID, ratio),
            duty_waves(defender, ratio),
            ClosedLoop(defender, defender, ratio),
            ClosedLoop(ALL, defender, ratio),
        )
    ]


def head_rooms(evidence: Evidence) -> list[HeadRoom]:
    """The table, ratio by ratio."""
    return [_head_room(evidence, defender, ratio) for ratio in RATIOS for defender in MAPS.values()]


def _head_room(evidence: Evidence, defender: str, ratio: float) -> HeadRoom:
    steady: FloatArray = evidence[steady_waves(defender, SOLID, ratio)]
    waves = duty_waves(defender, ratio)
    duties: FloatArray = evidence[waves]
    closed, verified = evidence[ClosedLoop(defender, defender, ratio)]
    return HeadRoom(
        defender=defender,
        power_ratio=ratio,
        throttle=float(steady[-1]),
        square=float(steady[:-1].max()),
        duty=float(duties.max()),
        best_wave=waves.waves[int(duties.argmax())],
        closed=closed,
        verified=verified,
        general=evidence[ClosedLoop(ALL, defender, ratio)][1],
    )
