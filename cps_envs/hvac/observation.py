"""What each role observes: names, units and fixed bounds of the fields, and the kernels that fill them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cps_envs.core.compute.kernels import Record, fill, inlined
from cps_envs.core.declare.config import extremes
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.declare.series import Series
from cps_envs.core.types import FloatArray
from cps_envs.hvac.building import AHEAD_H, outdoor_range
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.estimation import is_ready
from cps_envs.hvac.model import MEAN_H, Model, Rules
from cps_envs.hvac.parameters import DAY_S
from cps_envs.hvac.sensors import filter_sets, sensor_sets, sensors_of_choices
from cps_envs.hvac.state import State

NEAR_C = 10.0  # temperatures are shown within this of the reference
MOST_STD = 10.0  # of an innovation
MAX_LOG = 8.0  # of ln(1 + J / eps)


def _clock(config: HvacConfig) -> tuple[Field, ...]:
    return (
        Field("elapsed_h", "h", 0, config.duration_h, (), "since midnight of the first day"),
        Field("time_of_day", "-", -1, 1, (2,), "sine and cosine of the 24 h angle"),
    )


def _temperature(config: HvacConfig, name: str, shape: tuple[int, ...], meaning: str) -> Field:
    low, high = config.reference_range_c
    return Field(name, "C", low - NEAR_C, high + NEAR_C, shape, meaning)


def _readings(config: HvacConfig, name: str, meaning: str) -> Field:
    low, high = extremes(config.sensor_low_c)[0], extremes(config.sensor_high_c)[1]
    return Field(name, "C", low, high, (config.num_sensors,), meaning)


def _wanted(config: HvacConfig) -> Field:
    """The set-points, where they change."""
    low, high = config.reference_range_c
    shape = (config.num_zones if isinstance(config.reference_c, Series) else 0,)
    return Field("reference_c", "C", low - 1.0, high + 1.0, shape, "set-point of each zone now")


def _walls(config: HvacConfig) -> Field:
    """What is behind the walls, where that is a series."""
    timed = any(isinstance(each, Series) for each in (config.outdoor_c, config.ground_c, config.internal_heat_w))
    resistances = np.array(config.wall_resistance_k_per_w)
    heats = [float((resistances * end).min()) for end in extremes(config.internal_heat_w)]
    heats += [float((resistances * end).max()) for end in extremes(config.internal_heat_w)]
    around = (*outdoor_range(config), *extremes(config.ground_c))
    low, high = min(around) + min(heats), max(around) + max(heats)
    meaning = "behind each wall in the last step, as forecast: outside or ground, and internal heat times resistance"
    return Field("wall_c", "C", low, high, (config.num_zones if timed else 0,), meaning)


BY_CHOICE = ("last_choice", "last_estimate", "heating")  # fields that show what the defender chose, in a row


def _loop(config: HvacConfig) -> tuple[Field, ...]:
    """What the control loop does, and what the residuals say."""
    zones, sets, filters = config.num_zones, len(sensor_sets(config)), len(filter_sets(config))
    compared = (filters, config.num_sensors) if filters else (0,)
    return (
        _readings(config, "reading", "what each sensor shows now, forged or not"),
        Field("residual", "ln(1 + J/eps)", 0, MAX_LOG, (sets,), "of each set now, (4.32); 0 until `ready`"),
        Field("mean_residual", "ln(1 + J/eps)", 0, MAX_LOG, (sets,), "since the window is full, (4.33)"),
        Field("last_choice", "-", 0, 1, (len(sensors_of_choices(config)),), "of the defender one step ago, one-hot"),
        _temperature(config, "last_estimate", (zones,), "that the controller got one step ago"),
        Field("heating", "W", *config.heating_range_w, (zones,), "of the last step, as commanded"),
        Field("innovation", "std", -MOST_STD, MOST_STD, compared, "reading minus prediction of each Kalman filter"),
        Field("innovation_mean", "std", -MOST_STD, MOST_STD, compared, f"of the last {MEAN_H:g} h, weighted"),
    )


def attacker_fields(config: HvacConfig) -> Fields:
    """The own sensors and the clock; in the white-box view also the true temperatures and the control loop.

    Without `attacker_sees_choice` the loop leaves out what gives the defender's choice away: the choice itself, the
    estimate that it fed to the controller, and the heating that followed.
    """
    own = (
        _wanted(config),
        _readings(config, "measured", "compromised sensors before forging; the middle of the range for others"),
        Field("compromised", "-", 0, 1, (config.num_sensors,), "the attacker controls the sensor"),
        Field("active", "-", 0, 1, (), "this action forges readings: the next step is not before the onset"),
        Field("attack_h", "h", 0, config.duration_h, (), "age of the attack at the readings that this action forges"),
        *_clock(config),
    )
    seen = (_temperature(config, "temperature", (config.num_zones,), "true, of each zone now"), *_loop(config))
    if config.attacker_view == "grey":
        seen = tuple(_hidden(field) for field in seen)
    elif not config.attacker_sees_choice:
        seen = tuple(_hidden(field) if field.name in BY_CHOICE else field for field in seen)
    return Fields(*own, *seen)


def _hidden(field: Field) -> Field:
    return replace(field, shape=(0,))


def defender_fields(config: HvacConfig) -> Fields:
    """The control loop, what every choice would estimate, how the sets compare, and the weather to come."""
    zones, sets = config.num_zones, len(sensor_sets(config))
    choices = len(sensors_of_choices(config))
    coldest, warmest = outdoor_range(config)
    hours = ", ".join(f"{hour:g}" for hour in AHEAD_H)
    return Fields(
        *_loop(config),
        _temperature(config, "estimate", (choices, zones), "of each choice; all but the first alike until `ready`"),
        Field("better_half", "-", 0, 1, (sets,), "the set is in the better half by its residual (MTD1)"),
        Field("passes", "-", 0, 1, (sets,), "the set's mean residual is at most eps (MTD2)"),
        Field("ready", "-", 0, 1, (), "the window is full: sets can be chosen"),
        Field("samples", "-", 0, config.num_steps, (), "residuals in the means"),
        Field("outdoor_c", "C", coldest, warmest, (len(AHEAD_H),), f"outside temperature {hours} h ahead, as forecast"),
        *_clock(config),
        _wanted(config),
        _walls(config),
    )


@inlined
def observe_defender(model: Model, rules: Rules, episode: State, at: Record, row: FloatArray) -> None:
    """Fill `row` (size,) with `defender_fields` in their units; `at` says where each begins."""
    fill(row, 0.0)
    ready = is_ready(rules, episode)
    show_loop(rules, episode, at, row)
    show_choice(episode, at, row)
    put(episode.estimate.reshape(-1), row, at.estimate)
    if ready:
        mark_better_half(episode.residual, row[at.better_half : at.passes])
        for a in range(len(episode.residual)):
            row[at.passes + a] = episode.mean_residual[a] <= rules.threshold_c2
    row[at.ready] = ready
    row[at.samples] = max(episode.step[0] - rules.window_steps + 1, 0)
    for i in range(len(model.ahead)):
        row[at.outdoor_c + i] = model.outdoor[episode.first[0] + episode.step[0] + model.ahead[i]]
    show_clock(rules, episode, at, row)
    if rules.shows_reference:
        put(model.reference[episode.first[0] + episode.step[0]], row, at.reference_c)
    if rules.shows_walls:
        put(model.weather[episode.first[0] + max(episode.step[0] - 1, 0)], row, at.wall_c)


@inlined
def observe_attacker(model: Model, rules: Rules, episode: State, at: Record, row: FloatArray) -> None:
    """Fill `row` (size,) with `attacker_fields` in their units; `at` says where each begins."""
    fill(row, 0.0)
    age = episode.step[0] + 1 - episode.onset[0]
    for s in range(len(episode.measured)):
        hidden = 0.5 * (model.sensor_low_c[s] + model.sensor_high_c[s])
        row[at.measured + s] = episode.measured[s] if episode.compromised[s] else hidden
        row[at.compromised + s] = episode.compromised[s]
    row[at.active] = age >= 0
    row[at.attack_h] = max(age, 0) * rules.step_s / 3600.0
    show_clock(rules, episode, at, row)
    if rules.shows_reference:
        put(model.reference[episode.first[0] + episode.step[0]], row, at.reference_c)
    if rules.white_box:
        put(episode.temperature, row, at.temperature)
        show_loop(rules, episode, at, row)
        if rules.sees_choice:
            show_choice(episode, at, row)


@inlined
def show_loop(rules: Rules, episode: State, at: Record, row: FloatArray) -> None:
    """Fill in readings, residuals, which are 0 until the window is full, and innovations."""
    put(episode.reading, row, at.reading)
    if is_ready(rules, episode):
        for a in range(len(episode.residual)):
            row[at.residual + a] = math.log1p(episode.residual[a] / rules.threshold_c2)
            row[at.mean_residual + a] = math.log1p(episode.mean_residual[a] / rules.threshold_c2)
    put(episode.innovation.reshape(-1), row, at.innovation)
    put(episode.innovation_mean.reshape(-1), row, at.innovation_mean)


@inlined
def show_choice(episode: State, at: Record, row: FloatArray) -> None:
    """Fill in the fields `BY_CHOICE`."""
    if episode.step[0] > 0:
        row[at.last_choice + episode.choice[0]] = 1.0
    put(episode.fed, row, at.last_estimate)
    put(episode.heating, row, at.heating)


@inlined
def show_clock(rules: Rules, episode: State, at: Record, row: FloatArray) -> None:
    """Fill in the time of day."""
    time_s = episode.step[0] * rules.step_s
    angle = 2.0 * np.pi * time_s / DAY_S
    row[at.elapsed_h] = time_s / 3600.0
    row[at.time_of_day] = math.sin(angle)
    row[at.time_of_day + 1] = math.cos(angle)


@inlined
def put(values: FloatArray, row: FloatArray, at: int) -> None:
    """Write values (k,) into a row from `at` on."""
    for i in range(values.size):
        row[at + i] = values[i]


@inlined
def mark_better_half(residual: FloatArray, marks: FloatArray) -> None:
    """Mark the floor(sets / 2) sets of the smallest residual, the earlier ones where residuals are equal."""
    sets = residual.size
    for a in range(sets):
        mine, ahead = residual[a], 0
        for earlier in range(a):
            ahead += residual[earlier] <= mine
        for later in range(a + 1, sets):
            ahead += residual[later] < mine
        marks[a] = ahead < sets // 2
