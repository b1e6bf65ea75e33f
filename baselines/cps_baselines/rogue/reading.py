"""What kernels of attackers make of an observation, and what a policy remembers between decisions."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import Record, clip, inlined
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray, Observation, State
from cps_envs.rogue.reading import read


@inlined
def linear_effort(
    observation: Observation, scale: FloatArray, b: int, at: Record, gains: tuple[float, float], e: Record
) -> float:
    """The effort by which the linear law (5.15) drives environment `b`, within the limits; gains in 1/s2 and 1/s."""
    speed, ratio = read(observation, scale, b, at.speed), read(observation, scale, b, at.power_ratio)
    error = read(observation, scale, b, at.front_gap_error) - read(observation, scale, b, at.rear_gap_error)
    rate = read(observation, scale, b, at.front_gap_rate) - read(observation, scale, b, at.rear_gap_rate)
    wanted = gains[0] * error + gains[1] * rate + e.drag_per_s * speed
    return float(clip(wanted / (ratio * e.drive_mps2), e.min_effort, e.max_effort))


def since_onset(seen: Seen, state: State | None, duration_s: float) -> tuple[FloatArray, FloatArray]:
    """Seconds since the attack began, and when it began (B,); onsets are observed only until they have passed."""
    now_s = duration_s - seen["time_left_s"]
    onset_s = recalled(now_s + seen["until_onset_s"], seen, state)
    return now_s - onset_s, onset_s


def recalled(first: FloatArray, seen: Seen, state: State | None) -> FloatArray:
    """A fresh copy of the remembered array (B,), with `first` (B,) in the environments whose episode starts."""
    return first if state is None else np.where(seen.start, first, state[0])
