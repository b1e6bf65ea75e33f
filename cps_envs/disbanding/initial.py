"""The steady state in which every episode starts (specification 2.6), optionally perturbed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.disbanding.state import State

Envs = NDArray[np.bool_]
Vehicles = NDArray[np.float64]


def place(
    state: State,
    parameters: NDArray[np.void],
    envs: Envs,
    *,
    gap_factors: Vehicles | None = None,
    speed_offsets_mps: Vehicles | None = None,
    takeover_delays_s: Vehicles | None = None,
    driver_headways_s: Vehicles | None = None,
) -> None:
    """Put the episodes of the mask (B,) at time 0 in steady state: all platoons intact, accumulators cleared.

    The optional arrays are (B, M); entries of other episodes and of absent vehicles are ignored. `gap_factors` multiply
    the steady gaps (x_d inside a platoon, h v_d ahead of a leader), `speed_offsets_mps` are added to v_d and limited
    to the speed range, drivers take over `takeover_delays_s` after the disbanding (default 0) and keep
    `driver_headways_s` (default: the headway of the leaders).
    """
    for b in np.flatnonzero(envs):
        p = parameters[b]
        present = slice(0, int(p["num_vehicles"]))
        for array in state:
            array[b] = 0
        state.previous_gap[b] = np.inf
        state.disbanding_s[b] = np.inf
        state.first_collision_s[b] = -1.0
        state.moving[b] = True
        gaps, speeds = steady_gaps(p), np.full(p["num_vehicles"], p["desired_speed_mps"])
        if gap_factors is not None:
            gaps *= gap_factors[b, present]
        if speed_offsets_mps is not None:
            speeds += speed_offsets_mps[b, present]
        state.position[b, present] = -np.cumsum(gaps)
        state.speed[b, present] = np.clip(speeds, p["min_speed_mps"], p["max_speed_mps"])
        state.driver_headway_s[b, present] = p["headway_s"]
        if takeover_delays_s is not None:
            state.takeover_delay_s[b, present] = takeover_delays_s[b, present]
        if driver_headways_s is not None:
            state.driver_headway_s[b, present] = driver_headways_s[b, present]


def steady_gaps(p: np.void) -> Vehicles:
    """Gap (m) ahead of each vehicle (num_vehicles,) at the desired speed; 0 for the front vehicle."""
    gaps = np.full(p["num_vehicles"], p["desired_gap_m"])
    gaps[:: p["vehicles_per_platoon"]] = p["headway_s"] * p["desired_speed_mps"]
    gaps[0] = 0.0
    return gaps
