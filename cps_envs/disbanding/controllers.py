"""The controllers (2.2) to (2.6): one commanded acceleration per function, then one pass over an episode."""

from __future__ import annotations

import math

import numpy as np

from cps_envs.core.compute.kernels import clip, inlined
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.state import Constants, State

DEAD_BAND = 0.05  # m/s2, corrections smaller than this leave the plain law alone
TRANSITION_BRAKING = 2.0  # m/s2, braking need from which the transitional controller of S1 acts
TIME_TOLERANCE = 1e-9  # s


@inlined
def has_begun(time_s: float, start_s: float) -> bool:
    """Whether `start_s` is reached at `time_s` = step * dt, whose product may round down."""
    return time_s >= start_s - TIME_TOLERANCE


@inlined
def front_command(speed: float, desired_speed: float, k_d: float) -> float:
    """Command (m/s2) of the intact front vehicle of the string: holds the desired speed."""
    return k_d * (desired_speed - speed)


@inlined
def leader_command(gap: float, closing: float, speed: float, headway: float, k_p: float, k_d: float) -> float:
    """Command (m/s2) of a platoon leader, (2.4); `closing` = speed ahead minus own speed (m/s)."""
    return k_p * (gap - headway * speed) + k_d * closing


@inlined
def transitional_command(command: float, gap: float, closing: float, speed: float, headway: float) -> float:
    """A leader's command (m/s2) when it closes in from afar: brakes so as to arrive at h v with the speed ahead."""
    excess = gap - headway * speed
    if closing < 0.0 and excess > 0.0:
        braking = closing * closing / (2.0 * excess)
        if braking >= TRANSITION_BRAKING:
            return -braking
    return command


@inlined
def middle_command(
    gap: float, closing: float, rear_gap: float, rear_closing: float, desired_gap: float, k_p: float, k_d: float
) -> float:
    """Command (m/s2) of a vehicle between two of its platoon, (2.3); `rear_*` are those of the vehicle behind."""
    return k_p * ((gap - desired_gap) - (rear_gap - desired_gap)) + k_d * (closing - rear_closing)


@inlined
def last_command(gap: float, closing: float, desired_gap: float, k_p: float, k_d: float) -> float:
    """Command (m/s2) of the last vehicle of a platoon, (2.2)."""
    return k_p * (gap - desired_gap) + k_d * closing


@inlined
def human_command(gap: float, speed: float, speed_ahead: float, headway: float, c: Constants) -> float:
    """Command (m/s2) of a human driver, the Intelligent Driver Model (2.5) with its sign and root corrected.

    An infinite gap is a free road; a gap <= 0 means full braking, since the formula diverges there.
    """
    if gap <= 0.0:
        return c.min_acceleration_mps2
    comfort = 2.0 * math.sqrt(-c.min_acceleration_mps2 * c.max_acceleration_mps2)
    wanted = c.standstill_gap_m + max(0.0, speed * headway + speed * (speed - speed_ahead) / comfort)
    freedom, crowding = speed / c.desired_speed_mps, wanted / gap
    # Products, not powers: the same bits on every platform, on which the mitigated closed loops depend visibly.
    return c.max_acceleration_mps2 * (1.0 - freedom * freedom * freedom * freedom - crowding * crowding)


@inlined
def avoidance_margin(
    gap: float, speed: float, speed_ahead: float, standstill_gap: float, max_braking: float, one_sided: bool
) -> float:
    """Distance (m) between the gap and the bound of (2.6); collision avoidance brakes fully at 0 and below."""
    excess = speed * speed - speed_ahead * speed_ahead
    if one_sided:
        excess = max(0.0, excess)
    return gap - (standstill_gap + excess / (2.0 * max_braking))


@inlined
def corrected(command: float, correction: float, noise: float, full: float, low: float, high: float) -> float:
    """Rule (2.7) of the specification: the command (m/s2) after the defender's correction and its noise (m/s2).

    A correction is added to the command clipped to [`low`, `high`], together with the noise of the actuator. The sum is
    not clipped again, so that a defender can over-command against the lag as the plain law does. Below the dead band
    nothing happens. With `full` > 0 there is no such jump: clipping and noise grow in proportion to the correction,
    up to a correction of that size.
    """
    size = abs(correction)
    if full <= 0.0:
        return command if size < DEAD_BAND else clip(command, low, high) + correction + noise
    share = min(1.0, size / full)
    return command + share * (clip(command, low, high) - command + noise) + correction


@inlined
def most_forward_disbanded(disbanding_s: FloatArray, num_platoons: int, time_s: float) -> int:
    """Index from the front of the first platoon disbanded by `time_s`; `num_platoons` if there is none.

    A vehicle is mitigable when its platoon is intact and its index is larger than this one.
    """
    for platoon in range(num_platoons):
        if has_begun(time_s, disbanding_s[platoon]):
            return platoon
    return num_platoons


@inlined
def look_ahead(episode: State, num_vehicles: int, gap: FloatArray, closing: FloatArray) -> None:
    """Fill `gap` (m) and `closing` (m/s, speed ahead minus own) of each vehicle; the front one has a free road."""
    gap[0] = np.inf
    closing[0] = 0.0
    for q in range(1, num_vehicles):
        gap[q] = episode.position[q - 1] - episode.position[q]
        closing[q] = episode.speed[q - 1] - episode.speed[q]


@inlined
def command_platoons(episode: State, c: Constants, gap: FloatArray, closing: FloatArray, u: FloatArray) -> None:
    """Fill `u` (m/s2) with the commands of all vehicles as if every platoon were intact, (2.2) to (2.4)."""
    k_p, k_d, desired_gap, headway = c.proportional_gain, c.derivative_gain, c.desired_gap_m, c.headway_s
    size, speed, differ = c.vehicles_per_platoon, episode.speed, episode.tau_s.size > 0
    for q in range(c.num_vehicles - 1):
        if differ:
            k_p, k_d = episode.proportional_gain[q], episode.derivative_gain[q]
        u[q] = middle_command(gap[q], closing[q], gap[q + 1], closing[q + 1], desired_gap, k_p, k_d)
    for platoon in range(c.num_vehicles // size):
        last = platoon * size + size - 1
        if differ:
            k_p, k_d = episode.proportional_gain[last], episode.derivative_gain[last]
        u[last] = last_command(gap[last], closing[last], desired_gap, k_p, k_d)
        first = platoon * size
        if differ:
            k_p, k_d = episode.proportional_gain[first], episode.derivative_gain[first]
        command = leader_command(gap[first], closing[first], speed[first], headway, k_p, k_d)
        if c.transitional_controller:
            command = transitional_command(command, gap[first], closing[first], speed[first], headway)
        u[first] = command
    k_d = episode.derivative_gain[0] if differ else k_d
    u[0] = front_command(episode.speed[0], c.desired_speed_mps, k_d)


@inlined
def command_humans(episode: State, c: Constants, gap: FloatArray, time_s: float, u: FloatArray) -> None:
    """Overwrite `u` (m/s2) of the vehicles whose drivers have taken over by `time_s`, (2.5)."""
    size = c.vehicles_per_platoon
    for platoon in range(c.num_vehicles // size):
        disbanding_s = episode.disbanding_s[platoon]
        if has_begun(time_s, disbanding_s):
            for q in range(platoon * size, (platoon + 1) * size):
                if has_begun(time_s, disbanding_s + episode.takeover_delay_s[q]):
                    ahead = episode.speed[max(q - 1, 0)]
                    command = human_command(gap[q], episode.speed[q], ahead, episode.driver_headway_s[q], c)
                    until_s = disbanding_s + episode.takeover_delay_s[q] + episode.braking_s[q]
                    brakes = episode.braking_s[q] > 0.0 and not has_begun(time_s, until_s)
                    u[q] = min(command, -episode.braking_mps2[q]) if brakes else command
