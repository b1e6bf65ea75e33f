"""The travelled-distance heuristic, Algorithm 1: brake when you would cover more distance than the vehicle ahead."""

from __future__ import annotations

import math

from cps_envs.disbanding.commands import clip
from cps_envs.disbanding.lane import Constants, kernel

HORIZON_S = 0.5  # t_s; chosen, 0.5 to 2 s give similar errors
SAMPLE_S = 0.1  # Delta t_s
DECREMENT_MPS2 = 0.1  # Delta a
NUM_SAMPLES = 5  # t_s / Delta t_s


@kernel
def travelled_distance_command(
    law_command: float, command_ahead: float, gap: float, speed: float, speed_ahead: float, c: Constants
) -> float:
    """The command (m/s2) of one mitigable vehicle whose gap is shrinking, before collision avoidance.

    `law_command` is the raw command of its own law, returned unchanged where the heuristic sees no need to act;
    `command_ahead` is the predecessor's final command of this step, `gap` (m) and the speeds (m/s) are measured now.
    Equations (2.12) to (2.14), with (t_end - t_1)^2 in (2.14) and the search for a safe command going downward.
    """
    low, high, slowest, fastest = c.min_acceleration_mps2, c.max_acceleration_mps2, c.min_speed_mps, c.max_speed_mps
    ahead = clip(command_ahead, low, high)
    distance_ahead = travelled_distance(speed_ahead, ahead, slowest, fastest)
    if distance_ahead >= travelled_distance(speed, clip(law_command, low, high), slowest, fastest):
        return law_command
    command = clip((distance_ahead - speed * HORIZON_S) / (0.5 * HORIZON_S * HORIZON_S), low, high)
    while command > low and overlaps(gap, speed, command, speed_ahead, ahead, slowest, fastest):
        command = next_below(command, low)
    return command


@kernel
def travelled_distance(speed: float, command: float, slowest: float, fastest: float) -> float:
    """Distance (m) covered within the horizon under a constant command (m/s2), by (2.13) with limited speed."""
    distance = 0.0
    for _ in range(NUM_SAMPLES):
        distance += SAMPLE_S * speed
        speed = clip(speed + SAMPLE_S * command, slowest, fastest)
    return distance


@kernel
def overlaps(
    gap: float, speed: float, command: float, speed_ahead: float, command_ahead: float, slowest: float, fastest: float
) -> bool:
    """Whether the predicted gap (m) is <= 0 at some sample of the horizon."""
    for _ in range(NUM_SAMPLES):
        gap += SAMPLE_S * (speed_ahead - speed)
        if gap <= 0.0:
            return True
        speed = clip(speed + SAMPLE_S * command, slowest, fastest)
        speed_ahead = clip(speed_ahead + SAMPLE_S * command_ahead, slowest, fastest)
    return False


@kernel
def next_below(command: float, low: float) -> float:
    """The largest value low + i * DECREMENT_MPS2 smaller than `command` (m/s2), not below `low`.

    A value within a billionth of the grid counts as lying on it, so that the search always goes down.
    """
    return low + max(math.ceil((command - low) / DECREMENT_MPS2 - 1e-9) - 1, 0) * DECREMENT_MPS2
