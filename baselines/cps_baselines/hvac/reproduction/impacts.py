"""Figs. 4.7 and 4.8: impacts by attack, defence and number of attacked sensors, and where a defence fails."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.experiments import compared
from cps_baselines.hvac.reproduction.rules import equals
from cps_baselines.hvac.reproduction.scenario import Outcome
from cps_envs.core.types import FloatArray


def outcomes(evidence: Evidence, num_sensors: int, attacker: str, defender: str) -> list[Outcome]:
    """The bars of one attack and one defence: attack-free, then 1 to all sensors attacked."""
    return [evidence[compared(num_sensors, attacker, defender, count)] for count in range(num_sensors + 1)]


def impacts(evidence: Evidence, num_sensors: int, attacker: str, defender: str) -> FloatArray:
    """Their mean A_impact (n_s + 1,), C2."""
    return np.array([each.a_impact.mean() for each in outcomes(evidence, num_sensors, attacker, defender)])


def failing_line(evidence: Evidence, num_sensors: int) -> float:
    """The impact of attack-free days without any defence, C2: above it a defence has failed."""
    return float(evidence[compared(num_sensors, "none", "none", 0)].a_impact.mean())


def first_failing(values: FloatArray, line: float) -> int | None:
    """The smallest number of attacked sensors whose impact (n_s + 1,) exceeds the line; None if there is none."""
    above = np.flatnonzero(values[1:] > line)
    return int(above[0]) + 1 if len(above) else None


def lines_giving(values: FloatArray, count: int) -> tuple[float, float]:
    """The lines [low, high), C2, by which a defence with these impacts (n_s + 1,) first fails at `count` sensors."""
    return float(values[1:count].max()), float(values[count])


def equal_up_to(bars: list[Outcome]) -> int:
    """The largest number of attacked sensors up to which every impact equals the attack-free one, the first bar."""
    unequal = [count for count, each in enumerate(bars) if not equals(each, bars[0])]
    return unequal[0] - 1 if unequal else len(bars) - 1
