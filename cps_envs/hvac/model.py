"""Everything that is constant under a configuration, built once and shared by all games that have it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.declare.config import of_bodies, over_time, series_in
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.building import AHEAD_H, discretise, modes, outdoor, places_of, rates, weather
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.controller import control_of, feedforward
from cps_envs.hvac.kalman import filter_gains, memory
from cps_envs.hvac.moving_horizon import set_gains, warn_if_blind, window_gains
from cps_envs.hvac.powers import powers_of
from cps_envs.hvac.sensors import filter_sets, membership, sensor_sets, zones_of_sensors

MEAN_H = 2.0  # over which innovations are averaged, exponentially weighted
CHUNK = 16  # samples of the window of which one sum is kept all the time, see `window`


class Rules(NamedTuple):
    """The numbers of a configuration that kernels need."""

    step_s: float
    window_steps: int  # N_e
    num_steps: int  # K
    plan_steps: int  # N of a controller that plans, 0 of another
    initial_c: float
    move_weight: float  # R
    on_levels: bool  # and goes on from the level that was applied
    switches: bool  # the controller is a thermostat in each zone
    hysteresis_c: float
    threshold_c2: float  # eps of MTD2
    model_error: float
    unmeasured_heat_w: float
    filter_memory: float  # phi of `kalman`
    innovation_share: float  # of the newest innovation in their mean
    comfort_c: float
    thermostats: bool  # the last choice of the defender is thermostats
    base: int  # where the attacker's action says what, see `Powers`; -1 where it does not
    commands_at: int
    references_at: int
    deny_readings_at: int
    deny_commands_at: int
    white_box: bool  # the attacker sees the temperatures and the control loop
    sees_choice: bool  # and what the defender chose
    shows_reference: bool  # set-points change: both roles see them
    shows_walls: bool  # what is behind the walls is a series: the defender sees it


class Model(NamedTuple):
    """n zones with a plant each, S sensors, `sets` sets of sensors, a window of N_e samples.

    T is the K states of an episode and what is seen ahead of them; with series it is as long as these, and an episode
    begins at some sample of it.
    """

    A: FloatArray  # (n, n) nominal
    B: FloatArray  # (n,) C/W per step
    G: FloatArray  # (n,)
    rate: FloatArray  # (n, n) dt A_c
    weather: FloatArray  # (T, n) C, as forecast
    reference: FloatArray  # (T, n) C, x_r
    outside: BoolArray  # (n,) the wall faces the outside, not the ground
    begin_s: FloatArray  # () s, of the first sample
    outdoor: FloatArray  # (T,) C, as forecast
    least_w: FloatArray  # (n,) W, of the heating, below 0 where the plant cools
    most_w: FloatArray  # (n,) W, E
    level_w: FloatArray  # (n,) W
    command_attack_w: FloatArray  # (n,) W, most that an attack adds
    reference_attack_c: FloatArray  # (n,) C, most by which an attack shifts a set-point
    error_gain: FloatArray  # (n, n) W/C, K_e
    difference_gain: FloatArray  # (n, n) W/C, K_d
    feedforward: FloatArray  # (last place + K, n) W, K_w dW(k), and what set-points to come change
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
    noise_c: FloatArray  # (S,) C, standard deviation
    sensor_low_c: FloatArray  # (S,) C
    sensor_high_c: FloatArray  # (S,) C
    ahead: IntArray  # (len(AHEAD_H),) steps


@lru_cache(maxsize=64)
def build_model(config: HvacConfig) -> Model:
    """The constants of a configuration; the arrays are shared, nobody may write to them.

    Warns:
        ObservabilityWarning: some set of sensors hardly observes the building.
    """
    building, zone, member = discretise(config), zones_of_sensors(config), membership(config)
    ahead = np.round(np.array(AHEAD_H) * 3600.0 / config.step_s).astype(np.int64)
    places, n = places_of(config), config.num_zones
    times_s: FloatArray = places.begin_s + config.step_s * np.arange(places.steps, dtype=np.float64)
    w, reference = weather(config, times_s), over_time(config, "reference_c", times_s, n)
    control = control_of(config)
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
        weather=w,
        reference=reference,
        outside=~np.isin(np.arange(config.num_zones) + 1, config.ground_zones),
        begin_s=np.array(places.begin_s),
        outdoor=outdoor(config, times_s),
        least_w=of_bodies(config.min_heating_w, n),
        most_w=of_bodies(config.max_heating_w, n),
        level_w=of_bodies(config.max_heating_w, n) / config.num_levels,
        command_attack_w=of_bodies(config.command_attack_w, n),
        reference_attack_c=of_bodies(config.reference_attack_c, n),
        error_gain=control.K_e,
        difference_gain=control.K_d,
        feedforward=feedforward(control, w, reference, int(places.first.max()) + config.num_steps),
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
        noise_c=of_bodies(config.noise_std_c, config.num_sensors),
        sensor_low_c=of_bodies(config.sensor_low_c, config.num_sensors),
        sensor_high_c=of_bodies(config.sensor_high_c, config.num_sensors),
        ahead=ahead,
    )


def rules_of(config: HvacConfig) -> Rules:
    """The numbers of a configuration that kernels use."""
    derived: dict[str, Any] = {
        "plan_steps": config.prediction_steps if config.controller in ("qp", "levels") else 0,
        "on_levels": config.controller == "levels",
        "switches": config.controller == "on_off",
        "filter_memory": memory(config),
        "innovation_share": min(1.0, config.step_s / (3600.0 * MEAN_H)),
        "white_box": config.attacker_view == "white",
        "sees_choice": config.attacker_sees_choice,
        "shows_reference": "reference_c" in series_in(config),
        "shows_walls": bool(set(series_in(config)) - {"reference_c"}),
    }
    derived |= {name: at for name, at in powers_of(config)._asdict().items() if name in Rules._fields}
    return Rules(**derived, **{name: getattr(config, name) for name in Rules._fields if name not in derived})
