"""Recovery from an attack, by one rule in every chapter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_baselines.reproduction.verdicts import NEAR_SHARE, NOT, PARTLY, SAME_SHARE, of_cases, of_number
from cps_envs.core.types import BoolArray, FloatArray

RECOVERY_RULE = (
    f"Recovery, by the same rule in every chapter: each speed and each distance is, within {100 * SAME_SHARE:g} % of "
    "the desired one, what it is in the same run without the attack (same seed), from some time on to the end of the "
    "experiment that the paper describes; the time to recovery is that time. Where it is not, partly if it is within "
    f"{100 * NEAR_SHARE:g} %."
)


def deviation(values: FloatArray, calm: FloatArray, desired: FloatArray | float) -> FloatArray:
    """The largest difference over the last axis from the run without attack, as a share of what is desired.

    (..., T, M) with `calm` and `desired` that broadcast to it gives (..., T).
    """
    largest: FloatArray = np.max(np.abs((values - calm) / desired), axis=-1)
    return largest


def recovery_s(time_s: FloatArray, deviations: FloatArray, share: float = SAME_SHARE) -> float | None:
    """The time from which on all deviations (T,) are within a share to the end; None where the last one is not."""
    outside: BoolArray = deviations > share
    if outside[-1]:
        return None
    held = np.flatnonzero(outside)
    return float(time_s[held[-1] + 1]) if len(held) else float(time_s[0])


def of_recovery(same: Sequence[bool], near: Sequence[bool]) -> str:
    """A statement that all of some cases recover, which do so within SAME_SHARE, and within NEAR_SHARE."""
    verdict = of_cases(same)
    return PARTLY if verdict == NOT and any(near) else verdict


def of_recovery_time(same: float | None, near: float | None, paper: float) -> str:
    """The time to recovery within SAME_SHARE, and within NEAR_SHARE, against the paper's; None: never."""
    verdict = of_number(same, paper)
    return PARTLY if verdict == NOT and of_number(near, paper) != NOT else verdict
