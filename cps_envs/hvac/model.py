"""Everything that is constant under a configuration, built once and shared by all games that have it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.building import discretise, modes, outdoor, rates, weather
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.controller import feedforward, gains
from cps_envs.hvac.kalman import filter_gains, memory
from cps_envs.hvac.moving_horizon import set_gains, warn_if_blind, window_gains
from cps_envs.hvac.sensors import filter_sets, membership, sensor_sets, zones_of_sensors

MEAN_H = 2.0  # over which innovations are averaged, exponentially weighted
AHEAD_H = (0.0, 2.0, 4.0, 6.0)  # at which the defender sees the outside temperature
CHUNK = 16  # samples of the window of which one sum is kept all the time, see `window`


class Rules(NamedTuple):
    """The numbers of a configuration that kernels need."""

    step_s: float
    window_steps: int  # N_e
    reference_c: float
    initial_c: float
    max_heating_w: float
    level_w: float
    move_weight: float  # R
    plans: bool  # the controller solves (4.17) with its limits
    on_levels: bool  # and goes on from the level that was applied
    noise_std_c: float
    sensor_low_c: float
    sensor_high_c: float
    threshold_c2: float  # eps of MTD2
    model_error: float
    unmeasured_heat_w: float
    filter_memory: float  # phi of `kalman`
    innovation_share: float  # of the newest innovation in their mean
    comfort_c: float
    pays_discomfort: bool
    pays_energy: bool
    any_base: bool  # the attacker's action ends with what its readings are based on
    white_box: bool  # the attacker sees the temperatures and the control loop
    sees_choice: bool  # and what the defender chose


class Model(NamedTuple):
    """n zones with a heater each, S sensors, `sets` sets of sensors, K states, a window of N_e samples."""

    A: FloatArray  # (n, n) nominal
    B: FloatArray  # (n,) C/W per step
    G: FloatArray  # (n,)
    rate: FloatArray  # (n, n) dt A_c
    weather: FloatArray  # (K, n) C, as forecast
    coming: FloatArray  # (K + N, n) C, the same with what a controller that plans sees beyond; (0, n) for others
    outside: BoolArray  # (n,) the wall faces the outside, not the ground
    outdoor: FloatArray  # (K + 6 h,) C, as forecast
    error_gain: FloatArray  # (n, n) W/C, K_e
    difference_gain: FloatArray  # (n, n) W/C, K_d
    feedforward: FloatArray  # (K, n) W, K_w dW(k)
    decay: FloatArray  # (N_e + 1, S n) eigenvalues of A to the power t, once for each sensor
    mode: FloatArray  # (S n,) entry (zone(s), i) of V, whose columns are the eigenvectors of A
    set_gain: FloatArray  # (sets, n, n) transposed: [a, j, i] of A^N_e (O_a' O_a)^-1 V^-T at (i, j)
    window_gain: FloatArray  # (rows, n) of A^N_e pinv(O_a) transposed, for sets that hardly observe
    window_begin: IntArray  # (sets,) first row of a set in it, -1 where the sums serve
    member: BoolArray  # (sets, S)
    filter_member: BoolArray  # (F, S) of the Kalman filters
    filter_gain: FloatArray  # (F, 2n, S)
    filter_scale: FloatArray  # (F, S) 1/C
    zone: IntArray  # (S,) from 0
    ahead: IntArray  # (len(AHEAD_H),) steps


@lru_cache(maxsize=64)
def build_model(config: HvacConfig) -> Model:
    """The constants of a configuration; the arrays are shared, nobody may write to them.

    Warns:
        ObservabilityWarning: some set of sensors hardly observes the building.
    """
    building, zone, member = discretise(config), zones_of_sensors(config), membership(config)
    ahead = np.round(np.array(AHEAD_H) * 3600.0 / config.step_s).astype(np.int64)
    w = weather(config, config.num_steps + config.prediction_steps)
    control = gains(building, config.prediction_steps, config.move_weight)
    set_gain, condition = set_gains(building.A, config.window_steps, member, zone)
    window_gain, begin = window_gains(building.A, config.window_steps, member, zone, condition)
    eigenvalues, V = modes(config)
    powers = eigenvalues ** np.arange(config.window_steps + 1)[:, np.newaxis]
    warn_if_blind(condition, sensor_sets(config))
    filter_member = membership(config, filter_sets(config))
    filters = filter_gains(config, building, filter_member, zone)
    return Model(
        *building,
        rate=rates(config),
        weather=w[: config.num_steps].copy(),
        coming=w if config.controller != "clip" else w[:0],
        outside=~np.isin(np.arange(config.num_zones) + 1, config.ground_zones),
        outdoor=outdoor(config, config.num_steps + int(ahead[-1])),
        error_gain=control.K_e,
        difference_gain=control.K_d,
        feedforward=feedforward(control.K_w, w, config.num_steps),
        decay=np.tile(powers, len(zone)),
        mode=V[zone].ravel(),
        set_gain=np.ascontiguousarray(np.linalg.solve(V, set_gain.transpose(0, 2, 1))),
        window_gain=window_gain,
        window_begin=begin,
        member=member,
        filter_member=filter_member,
        filter_gain=filters.gain,
        filter_scale=filters.scale,
        zone=zone,
        ahead=ahead,
    )


def rules_of(config: HvacConfig) -> Rules:
    """The numbers of a configuration that kernels use."""
    derived: dict[str, Any] = {
        "level_w": config.max_heating_w / config.num_levels,
        "plans": config.controller != "clip",
        "on_levels": config.controller == "levels",
        "filter_memory": memory(config),
        "innovation_share": min(1.0, config.step_s / (3600.0 * MEAN_H)),
        "pays_discomfort": config.payoff == "discomfort",
        "pays_energy": config.payoff == "energy",
        "any_base": config.attack_action == "any",
        "white_box": config.attacker_view == "white",
        "sees_choice": config.attacker_sees_choice,
    }
    return Rules(**derived, **{name: getattr(config, name) for name in Rules._fields if name not in derived})
