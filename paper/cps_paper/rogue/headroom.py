"""What attackers can do in the setting of the learning problem: square waves, other duties, closed loop."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from cps_envs.core.types import FloatArray
from cps_paper.exhibit import Column, ExhibitTable, with_properties
from cps_paper.rogue.experiments import ClosedLoop, Ride, RogueEvidence, Waves, steady_waves
from cps_paper.rogue.heat_map import LEARNING_S, MAPS, SOLID, STEADY_HZ, TITLES
from cps_paper.rogue.worlds import ALL, RATIOS
from cps_paper.verdicts import shipped_rows

DUTY_HZ = tuple(np.round(np.geomspace(0.01, 0.6, 18), 4).tolist())
DUTIES = tuple(np.round(np.linspace(0.45, 0.95, 11), 2).tolist())
SHIPPED = shipped_rows("cps_paper.rogue", "headroom")
GENERAL_RIDE = Ride("sliding_detection", contact=SOLID, duration_s=LEARNING_S, attacker="switching")


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
        rows = {(row["defender"], float(row["power_ratio"])): row for row in SHIPPED}
        row = rows[self.defender, self.power_ratio]
        return {name: float(row[name]) for name in ("square", "duty", "closed", "verified")}


def duty_waves(defender: str, power_ratio: float) -> Waves:
    """Square waves of many frequencies and duties."""
    return Waves(defender, power_ratio, SOLID, LEARNING_S, waves=tuple(product(DUTY_HZ, DUTIES)))


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


def head_rooms(evidence: RogueEvidence) -> list[HeadRoom]:
    """The table, ratio by ratio."""
    return [_head_room(evidence, defender, ratio) for ratio in RATIOS for defender in MAPS.values()]


def _head_room(evidence: RogueEvidence, defender: str, ratio: float) -> HeadRoom:
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


def head_rooms_table(evidence: RogueEvidence) -> ExhibitTable:
    """Kinds of attackers in the setting of the learning problem."""
    title = "Head-room above the paper's attacker"
    data = with_properties("other")
    return ExhibitTable(title, COLUMNS, head_rooms(evidence), NOTES, left=2, grouped=1, data=data)


def _beside(name: str) -> Column:
    """A number, and in brackets what an independent implementation found."""
    heading = "searched" if name == "closed" else name
    return Column(heading, lambda each: (getattr(each, name), each.other[name]), "{:.1f} ({:g})")


COLUMNS = (
    Column("ratio", "power_ratio", "{:g}"),
    Column("", lambda each: TITLES[each.defender]),
    Column("throttle", "throttle", "{:.1f}"),
    _beside("square"),
    _beside("duty"),
    Column("at", "best_wave", "{:.3g} Hz, {:g}"),
    _beside("closed"),
    _beside("verified"),
    Column("general", "general", "{:.1f}"),
)
NOTES = (
    "Contact solid, 60 s, m/s; in brackets what an independent implementation found. square: best of "
    f"{len(STEADY_HZ)} frequencies; duty: best of {len(DUTY_HZ)} frequencies x {len(DUTIES)} duties, with where.",
    "searched: `switching?against=...`; verified: the same at half the step, mean over worlds with drive and drag "
    "changed by up to 0.3 %; general: `switching`, searched against all at once, verified in the same way.",
    "A lower bound of what is possible. The paper's attacker is the square wave.",
)
