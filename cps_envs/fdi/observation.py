"""What each role observes, and which actions are legal: fields with units and fixed bounds, and how they are filled."""

from __future__ import annotations

from cps_envs.core.compute.kernels import borrowed, copy, inlined, kernel, room, view
from cps_envs.core.declare.fields import Field, Fields, encode_row
from cps_envs.core.types import Array, FloatArray, IntArray, Observation
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.controller import feedback
from cps_envs.fdi.filtered import MAX_ERROR_GAPS, MAX_RATE_MPS, fill_shared, filtered_fields, shared_fields
from cps_envs.fdi.state import Batch, Constants, State, constants_for

MAX_COMMAND_SHARE = 4.0  # commands without injection are shown within four times the limit


def is_drawn(config: FdiConfig) -> bool:
    """Whether resets draw the task."""
    return bool(config.tasks)


def num_slots(config: FdiConfig) -> int:
    """How many injections an action has: one for each attacked sensor, or for every sensor where tasks are drawn."""
    return config.num_readings if is_drawn(config) else config.fixed_task.sensors.count


def attacker_fields(config: FdiConfig) -> Fields:
    """The true errors of every pair, vehicle 1 (last) first, what the controllers make of them, and the task."""
    n, slots = config.num_vehicles, num_slots(config)
    furthest = MAX_ERROR_GAPS * config.desired_gap_m
    strongest = MAX_COMMAND_SHARE * max(config.max_acceleration_mps2, -config.min_acceleration_mps2)
    shown, readings = (n, config.num_readings) if is_drawn(config) else (0, 0)
    filters = config.estimator == "kalman"
    return Fields(
        Field("gap_error", "m", -furthest, furthest, (n,), "e_x,i: gap ahead of vehicle i minus x_d"),
        Field("relative_speed", "m/s", -MAX_RATE_MPS, MAX_RATE_MPS, (n,), "e_v,i, negative when closing"),
        Field("command", "m/s2", -strongest, strongest, (n,), "of the law (3.7) without injection"),
        Field("injection", "-", -1, 1, (slots,), "last one, as share of d_max"),
        Field("steps_left", "steps", 0, config.horizon, (), "until the horizon"),
        Field("attacked", "-", 0, 1, (readings,), "sensors under attack, in the order of the readings"),
        Field("target", "-", 0, 1, (shown,), "one-hot: the vehicle that is to hit the one ahead"),
        Field("wait", "steps", 0, config.horizon, (int(filters),), "before an injection of now would work"),
        *shared_fields(config),
        Field("trust", "-", 0, 1, (config.num_readings if filters else 0,), "1 where the last reading was used"),
    )


def defender_fields(config: FdiConfig) -> Fields:
    """What the sensors reported in the last step and what a model expected; never the true errors."""
    if config.estimator == "kalman":
        return filtered_fields(config)
    n = config.num_vehicles
    furthest = config.max_range_injection_m + MAX_ERROR_GAPS * config.desired_gap_m
    fastest = config.max_rate_injection_mps + MAX_RATE_MPS
    strongest = max(config.max_acceleration_mps2, -config.min_acceleration_mps2)
    rear = "range of vehicle i minus rear range of vehicle i+1"
    return Fields(
        Field("range_error", "m", -furthest, furthest, (n,), "reported range minus x_d"),
        Field("range_rate", "m/s", -fastest, fastest, (n,), "reported range-rate"),
        Field("range_innovation", "m", -furthest, furthest, (n,), "reported minus predicted range"),
        Field("rate_innovation", "m/s", -fastest, fastest, (n,), "reported minus predicted range-rate"),
        Field("kinematic_residual", "m", -furthest, furthest, (n,), "change of range minus mean range-rate times dt"),
        Field("redundancy_residual", "m", -furthest, furthest, (n - 1,), rear),
        Field("command", "m/s2", -strongest, strongest, (n,), "applied in the last step"),
        Field("trust", "-", 0, 1, (2 * n,), "1 where the last reading was used: ranges 1..n, then range-rates"),
        Field("steps_left", "steps", 0, config.horizon, (), "until the horizon"),
        *shared_fields(config),
    )


@kernel
def observe_attacker(batch: Batch, observations: Observation) -> None:
    """Fill (B, size) with `attacker_fields`."""
    values, offsets, scale = room(observations.shape[1]), batch.attacker.offsets, batch.attacker.scale
    for b in range(observations.shape[0]):
        episode, c = view(batch.state, b), constants_for(batch, b)
        fill_attacker(episode, c, batch.tasks[episode.task[0]], borrowed(offsets), borrowed(values))
        encode_row(borrowed(values), borrowed(scale), borrowed(observations)[b])


@inlined
def fill_attacker(episode: State, c: Constants, task: IntArray, offsets: Array, row: FloatArray) -> None:
    """The values (size,) of one episode in the units of the fields; `offsets` (1,) are where they begin."""
    n, slots, at = episode.command.size, task.size - 1, offsets[0]
    copy(episode.error[:n], row[at.gap_error :])
    copy(episode.error[n:], row[at.relative_speed :])
    for i in range(n):
        row[at.command + i] = feedback(episode.error, c, i)
    for slot in range(slots):
        sensor = task[slot]
        row[at.injection + slot] = 0.0
        if sensor >= 0:
            ranges = sensor < c.readings // 2
            largest = c.range_levels * c.range_resolution_m if ranges else c.rate_levels * c.rate_resolution_mps
            row[at.injection + slot] = episode.injection[sensor] / largest
    row[at.steps_left] = c.horizon - episode.step[0]
    if c.draws:
        for j in range(c.readings):
            row[at.attacked + j] = 1.0 if task[j] >= 0 else 0.0
        for i in range(n):
            row[at.target + i] = 1.0 if task[slots] == i else 0.0
    fill_shared(episode, c, offsets, row)
    if c.filters:
        row[at.wait] = max(min(episode.onset[0], c.horizon) - episode.step[0] - 1, 0)
        copy(episode.trust, row[at.trust :])


@kernel
def observe_defender(batch: Batch, observations: Observation) -> None:
    """Fill (B, size) with `defender_fields`."""
    values, offsets, scale = room(observations.shape[1]), batch.defender.offsets, batch.defender.scale
    for b in range(observations.shape[0]):
        fill_defender(view(batch.state, b), constants_for(batch, b), borrowed(offsets), borrowed(values))
        encode_row(borrowed(values), borrowed(scale), borrowed(observations)[b])


@inlined
def fill_defender(episode: State, c: Constants, offsets: Array, row: FloatArray) -> None:
    """The values (size,) of one episode in the units of the fields; `offsets` (1,) are where they begin."""
    n, at = episode.command.size, offsets[0]
    for i in range(n):
        row[at.range_error + i] = episode.reading[i]
        row[at.range_rate + i] = episode.reading[n + i]
        row[at.range_innovation + i] = episode.reading[i] - episode.prediction[i]
        row[at.rate_innovation + i] = episode.reading[n + i] - episode.prediction[n + i]
        row[at.kinematic_residual + i] = episode.residual[i]
        row[at.command + i] = episode.command[i]
        if i < n - 1:
            row[at.redundancy_residual + i] = episode.reading[i] - episode.rear[i]
    copy(episode.trust, row[at.trust :])
    row[at.steps_left] = c.horizon - episode.step[0]
    fill_shared(episode, c, offsets, row)


@kernel
def fill_masks(legal: IntArray, bounds: IntArray, masks: Array) -> None:
    """Fill int8 masks (B, sum(2 bounds + 1)) from the legal levels (B, S, 2); bounds (S,) are the largest levels."""
    for b in range(masks.shape[0]):
        fill_mask(borrowed(legal)[b], bounds, borrowed(masks)[b])


@inlined
def fill_mask(legal: IntArray, bounds: IntArray, mask: Array) -> None:
    """Fill the mask of one episode.

    Where a state leaves a sensor nothing, the mask offers no injection: that move is illegal too, and ends the episode.
    """
    mask[:], start = 0, 0
    for s in range(bounds.size):
        low, high = legal[s]
        if low > high:
            low = high = 0
        mask[start + bounds[s] + low : start + bounds[s] + high + 1] = 1
        start += 2 * bounds[s] + 1
