"""What an observer asks about the state at time t, answered by the same laws that the dynamics applies next."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.disbanding.commands import (
    avoidance_margin,
    front_law,
    has_begun,
    human_law,
    last_law,
    leader_law,
    middle_law,
    most_forward_disbanded,
    transitional_law,
)
from cps_envs.disbanding.dynamics import command_by_law
from cps_envs.disbanding.lane import Constants, constants_of, kernel, lane_of
from cps_envs.disbanding.state import State


@kernel
def law_commands(state: State, parameters: NDArray[np.void], out: NDArray[np.float64]) -> None:
    """Fill `out` (B, M) with the command (m/s2) that the plain law gives each vehicle now; absent ones are left."""
    vehicles = state.position.shape[1]
    gap, closing = np.empty(vehicles), np.empty(vehicles)
    for b in range(state.step.shape[0]):
        command_by_law(lane_of(state, b), constants_of(parameters, b), gap, closing, out[b])


@kernel
def law_command(state: State, parameters: NDArray[np.void], b: int, q: int) -> float:
    """The plain law's command (m/s2) of vehicle `q` in lane `b` now: entry [b, q] of `law_commands`, bit for bit."""
    c, speed = constants_of(parameters, b), state.speed[b]
    gap, closing = gap_ahead(state, b, q), closing_speed(state, b, q)
    disbanding_s = state.disbanding_s[b, q // c.vehicles_per_platoon]
    if has_begun(state.step[b] * c.dt_s, disbanding_s + state.takeover_delay_s[b, q]):
        return human_law(gap, speed[q], speed[max(q - 1, 0)], state.driver_headway_s[b, q], c)
    k_p, k_d, place = c.proportional_gain, c.derivative_gain, q % c.vehicles_per_platoon
    if q == 0:
        return front_law(speed[0], c.desired_speed_mps, k_d)
    if place == 0:
        command = leader_law(gap, closing, speed[q], c.headway_s, k_p, k_d)
        if c.transitional_controller:
            return transitional_law(command, gap, closing, speed[q], c.headway_s)
        return command
    if place == c.vehicles_per_platoon - 1:
        return last_law(gap, closing, c.desired_gap_m, k_p, k_d)
    rear_gap, rear_closing = gap_ahead(state, b, q + 1), closing_speed(state, b, q + 1)
    return middle_law(gap, closing, rear_gap, rear_closing, c.desired_gap_m, k_p, k_d)


@kernel
def gap_ahead(state: State, b: int, q: int) -> float:
    """Gap (m) of vehicle `q` in lane `b` to its predecessor; +inf for the front vehicle."""
    return np.inf if q == 0 else state.position[b, q - 1] - state.position[b, q]


@kernel
def closing_speed(state: State, b: int, q: int) -> float:
    """Speed of the predecessor minus the own speed (m/s); 0 for the front vehicle."""
    return 0.0 if q == 0 else state.speed[b, q - 1] - state.speed[b, q]


@kernel
def brake_margin(state: State, parameters: NDArray[np.void], b: int, q: int) -> float:
    """Distance (m) of vehicle `q` to the bound (2.6), at and below which it brakes fully; +inf for the front one."""
    if q == 0:
        return np.inf
    c: Constants = constants_of(parameters, b)
    speed, ahead, braking = state.speed[b, q], state.speed[b, q - 1], -c.min_acceleration_mps2
    return avoidance_margin(gap_ahead(state, b, q), speed, ahead, c.standstill_gap_m, braking, c.one_sided_avoidance)


@kernel
def mitigable(state: State, parameters: NDArray[np.void], b: int, q: int) -> bool:
    """Whether a correction acts on vehicle `q`: its platoon is intact and upstream of a disbanded one."""
    c = constants_of(parameters, b)
    time_s, platoon = state.step[b] * c.dt_s, q // c.vehicles_per_platoon
    if has_begun(time_s, state.disbanding_s[b, platoon]):
        return False
    return most_forward_disbanded(state.disbanding_s[b], platoon, time_s) < platoon
