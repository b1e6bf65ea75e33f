"""Kernels that read observations off an episode, in physical units and in the order of `fields.py`."""

from __future__ import annotations

import numpy as np

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.hvac.building import DAY_S
from cps_envs.hvac.estimation import is_ready
from cps_envs.hvac.metrics import mean_residual, passes
from cps_envs.hvac.model import Model
from cps_envs.hvac.state import State


@inlined
def put(row: FloatArray, at: int, values: FloatArray) -> int:
    """Write `values` at `at`; returns the place after them."""
    for i in range(len(values)):
        row[at + i] = values[i]
    return at + len(values)


@inlined
def put_clock(model: Model, episode: State, row: FloatArray, at: int) -> int:
    """Hours since the start, sine and cosine of the time of day."""
    time_s = episode.step[0] * model.step_s
    angle = 2.0 * np.pi * time_s / DAY_S
    row[at] = time_s / 3600.0
    row[at + 1] = np.sin(angle)
    row[at + 2] = np.cos(angle)
    return at + 3


@inlined
def put_loop(model: Model, episode: State, row: FloatArray) -> int:
    """Readings, residuals, the last choice and what it led to; returns how many entries that are."""
    sets = len(model.member)
    at = put(row, 0, episode.reading)
    if is_ready(model, episode):
        for a in range(sets):
            row[at + a] = np.log1p(episode.residual[a] / model.threshold_c2)
            row[at + sets + a] = np.log1p(mean_residual(model, episode, a) / model.threshold_c2)
    at += 2 * sets
    if episode.step[0] > 0:
        row[at + episode.choice[0]] = 1.0
    at = put(row, at + sets + 2, episode.fed)
    return put(row, at, episode.heating)


@inlined
def observe_attacker(model: Model, episode: State, loop: FloatArray, row: FloatArray) -> None:
    """Fill `row` (size,) with `attacker_fields`; `loop` is what the defender sees of the control loop."""
    row[:] = 0.0
    sensors, age = len(model.zone), episode.step[0] + 1 - episode.onset[0]
    for s in range(sensors):
        row[s] = episode.measured[s] if episode.compromised[s] else 0.5 * (model.sensor_low_c + model.sensor_high_c)
        row[sensors + s] = episode.compromised[s]
    row[2 * sensors] = age >= 0
    row[2 * sensors + 1] = max(age, 0) * model.step_s / 3600.0
    at = put_clock(model, episode, row, 2 * sensors + 2)
    if model.white_box:
        put(row, put(row, at, episode.temperature), loop)


@inlined
def observe_defender(model: Model, episode: State, row: FloatArray) -> int:
    """Fill `row` (size,) with `defender_fields`; returns how many of them, the first, are of the control loop."""
    row[:] = 0.0
    sets, ready = len(model.member), is_ready(model, episode)
    loop = put_loop(model, episode, row)
    at = loop
    for choice in range(sets + 2):
        at = put(row, at, episode.estimate[choice])
    if ready:
        mark_better_half(episode.residual, row[at : at + sets])
        for a in range(sets):
            row[at + sets + a] = passes(model, episode, a)
    at += 2 * sets
    row[at] = ready
    row[at + 1] = max(episode.step[0] - len(model.window) + 1, 0)
    at += 2
    for i in range(len(model.ahead)):
        row[at + i] = model.outdoor[episode.step[0] + model.ahead[i]]
    put_clock(model, episode, row, at + len(model.ahead))
    return loop


@inlined
def mark_better_half(residual: FloatArray, out: FloatArray) -> None:
    """Mark the floor(sets / 2) sets of the smallest residual, the earlier ones where residuals are equal."""
    sets = len(residual)
    for a in range(sets):
        ahead = 0
        for other in range(sets):
            ahead += residual[other] < residual[a] or (residual[other] == residual[a] and other < a)
        out[a] = ahead < sets // 2
