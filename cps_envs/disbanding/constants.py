"""One episode of a batch as kernels see it: views of its state and its constants as plain numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.state import State


class Constants(NamedTuple):
    """One record of `parameters.PARAMETERS`, field by field.

    Kernels take this instead of the record: numbers passed by value let the compiler vectorise the loops over
    vehicles (about twice the speed), which loads from a record that may alias the state do not.
    """

    num_vehicles: int
    vehicles_per_platoon: int
    dt_s: float
    tau_s: float
    desired_gap_m: float
    headway_s: float
    proportional_gain: float
    derivative_gain: float
    desired_speed_mps: float
    min_speed_mps: float
    max_speed_mps: float
    min_acceleration_mps2: float
    max_acceleration_mps2: float
    standstill_gap_m: float
    exact_integration: bool
    saturate_command: bool
    one_sided_avoidance: bool
    transitional_controller: bool
    inelastic_contact: bool
    stop_at_collision: bool


@kernel
def constants_of(parameters: NDArray[np.void], b: int) -> Constants:
    """The constants of episode `b` of the parameters (B,)."""
    p = parameters[b]
    return Constants(
        p.num_vehicles,
        p.vehicles_per_platoon,
        p.dt_s,
        p.tau_s,
        p.desired_gap_m,
        p.headway_s,
        p.proportional_gain,
        p.derivative_gain,
        p.desired_speed_mps,
        p.min_speed_mps,
        p.max_speed_mps,
        p.min_acceleration_mps2,
        p.max_acceleration_mps2,
        p.standstill_gap_m,
        p.exact_integration,
        p.saturate_command,
        p.one_sided_avoidance,
        p.transitional_controller,
        p.inelastic_contact,
        p.stop_at_collision,
    )


@kernel
def episode_of(state: State, b: int) -> State:
    """Views of episode `b`: the same fields without the episode axis, per-episode scalars as arrays of length one."""
    return State(
        state.step[b : b + 1],
        state.position[b],
        state.speed[b],
        state.acceleration[b],
        state.command[b],
        state.previous_gap[b],
        state.disbanding_s[b],
        state.takeover_delay_s[b],
        state.driver_headway_s[b],
        state.speed_error[b],
        state.intact_error[b : b + 1],
        state.rear_collided[b],
        state.collided[b],
        state.collided_intact[b],
        state.first_collision_s[b : b + 1],
        state.stops[b],
        state.moving[b],
    )
