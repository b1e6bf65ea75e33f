"""The travelled-distance heuristic, Algorithm 1: brake when you would cover more distance than the vehicle ahead."""

from __future__ import annotations

import math
from typing import NamedTuple

from cps_envs.core.kernels import clip, inlined
from cps_envs.disbanding.state import Constants


class Foresight(NamedTuple):
    """How far and how finely the heuristic looks ahead; the defaults are chosen, as the paper prints none."""

    num_samples: int = 5  # t_s / Delta t_s; t_s from 0.5 to 2 s gives similar errors
    sample_s: float = 0.1  # Delta t_s
    decrement_mps2: float = 0.1  # Delta a
    clearance_m: float = 0.0  # a command is safe while the predicted gaps stay above this


FORESIGHT = Foresight()


@inlined
def travelled_distance_command(
    law_command: float,
    command_ahead: float,
    gap: float,
    speed: float,
    speed_ahead: float,
    c: Constants,
    foresight: Foresight,
) -> float:
    """The command (m/s2) of one mitigable vehicle whose gap is shrinking, before collision avoidance.

    `law_command` is the raw command of its own law, returned unchanged where the heuristic sees no need to act;
    `command_ahead` is the predecessor's final command of this step, `gap` (m) and the speeds (m/s) are measured now.
    Equations (2.12) to (2.14), with (t_end - t_1)^2 in (2.14) and the search for a safe command going downward.
    """
    low, high, slowest, fastest = c.min_acceleration_mps2, c.max_acceleration_mps2, c.min_speed_mps, c.max_speed_mps
    ahead = clip(command_ahead, low, high)
    distance_ahead = travelled_distance(speed_ahead, ahead, slowest, fastest, foresight)
    if distance_ahead >= travelled_distance(speed, clip(law_command, low, high), slowest, fastest, foresight):
        return law_command
    horizon_s = foresight.num_samples * foresight.sample_s
    command = clip((distance_ahead - speed * horizon_s) / (0.5 * horizon_s * horizon_s), low, high)
    while command > low and overlaps(gap, speed, command, speed_ahead, ahead, slowest, fastest, foresight):
        command = next_below(command, low, foresight.decrement_mps2)
    return command


@inlined
def travelled_distance(speed: float, command: float, slowest: float, fastest: float, foresight: Foresight) -> float:
    """Distance (m) covered within the horizon under a constant command (m/s2), by (2.13) with limited speed."""
    distance, sample_s = 0.0, foresight.sample_s
    for _ in range(foresight.num_samples):
        distance += sample_s * speed
        speed = clip(speed + sample_s * command, slowest, fastest)
    return distance


@inlined
def overlaps(
    gap: float,
    speed: float,
    command: float,
    speed_ahead: float,
    command_ahead: float,
    slowest: float,
    fastest: float,
    foresight: Foresight,
) -> bool:
    """Whether the predicted gap (m) does not stay above the clearance at some sample of the horizon."""
    sample_s = foresight.sample_s
    for _ in range(foresight.num_samples):
        gap += sample_s * (speed_ahead - speed)
        if gap <= foresight.clearance_m:
            return True
        speed = clip(speed + sample_s * command, slowest, fastest)
        speed_ahead = clip(speed_ahead + sample_s * command_ahead, slowest, fastest)
    return False


@inlined
def next_below(command: float, low: float, decrement: float) -> float:
    """The largest value low + i * decrement smaller than `command` (m/s2), not below `low`.

    A value within a billionth of the grid counts as lying on it, so that the search always goes down.
    """
    return low + max(math.ceil((command - low) / decrement - 1e-9) - 1, 0) * decrement
