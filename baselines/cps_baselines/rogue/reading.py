"""What kernels of attackers make of an observation, and what a policy remembers between decisions."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_envs.core.compute.kernels import Record, clip, inlined
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import FloatArray, Observation, State
from cps_envs.rogue.reading import read


@inlined
def linear_effort(
    observation: Observation, scale: FloatArray, b: int, seat: int, at: Record, gains: tuple[float, float], e: Record
) -> float:
    """The effort by which the linear law (5.15) drives a seized vehicle of environment `b`, within the limits.

    `seat` counts the seized vehicles from the rear; gains are in 1/s2 and 1/s.
    """
    speed, ratio = read(observation, scale, b, at.speed + seat), read(observation, scale, b, at.power_ratio)
    ahead_m, behind_m = at.front_gap_error + seat, at.rear_gap_error + seat
    error = read(observation, scale, b, ahead_m) - read(observation, scale, b, behind_m)
    rates = at.front_gap_rate + seat, at.rear_gap_rate + seat
    rate = read(observation, scale, b, rates[0]) - read(observation, scale, b, rates[1])
    wanted = gains[0] * error + gains[1] * rate + e.drag_per_s * speed
    return float(clip(wanted / (ratio * e.drive_mps2), e.min_effort, e.max_effort))


def require_one(spec: RoleSpec, policy: Any) -> None:
    """Refuse platoons in which several vehicles attack together.

    Raises:
        ConfigurationError: this is one.
    """
    if spec.config.num_seized > 1:
        raise ConfigurationError(
            f"{type(policy).__name__} knows one attacker, and attacker_indices = {spec.config.attacker_indices}: give "
            "attacker_index, or take a policy that treats all vehicles alike"
        )


def since_onset(seen: Seen, state: State | None, duration_s: float) -> tuple[FloatArray, FloatArray]:
    """Seconds since the attack began, and when it began (B,); onsets are observed only until they have passed."""
    now_s = duration_s - seen["time_left_s"]
    onset_s = recalled(now_s + seen["until_onset_s"], seen, state)
    return now_s - onset_s, onset_s


def recalled(first: FloatArray, seen: Seen, state: State | None) -> FloatArray:
    """A fresh copy of the remembered array (B,), with `first` (B,) in the environments whose episode starts."""
    return first if state is None else np.where(seen.start, first, state[0])
