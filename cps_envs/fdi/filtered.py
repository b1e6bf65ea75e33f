"""What a defender with a filter observes: readings of front and rear sensors, and how far they lie off the filter."""

from __future__ import annotations

from cps_envs.core.compute.kernels import borrowed, copy, inlined, kernel, room, view
from cps_envs.core.declare.fields import Field, Fields, encode_row
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.estimation import deviation_of, innovation_of
from cps_envs.fdi.state import Batch, Constants, State, constants_for

MAX_RATE_MPS = 20.0
MAX_ERROR_GAPS = 4.0  # gap errors are shown within four desired gaps
ORDER = "fronts of 1..n, rears of 2..n"


def shared_fields(config: FdiConfig) -> tuple[Field, ...]:
    """The state of the filter and the drawn gains, which both roles see; nothing where there is no filter."""
    filters = config.estimator == "kalman"
    pairs, readings = (config.num_vehicles, config.num_readings) if filters else (0, 0)
    furthest, gains = MAX_ERROR_GAPS * config.desired_gap_m, 2 if config.gain_spread > 0 else 0
    return (
        Field("predicted_gap_error", "m", -furthest, furthest, (pairs,), "of the filter, before the readings of now"),
        Field("predicted_speed", "m/s", -MAX_RATE_MPS, MAX_RATE_MPS, (pairs,), "of the filter: e_v,i"),
        Field("range_deviation", "m", 0, furthest, (readings // 2,), f"expected of an innovation: {ORDER}"),
        Field("rate_deviation", "m/s", 0, MAX_RATE_MPS, (readings // 2,), f"expected of an innovation: {ORDER}"),
        Field("gain", "-", 0.5, 1.5, (gains,), "k_p and k_d, as parts of the configured ones"),
    )


def filtered_fields(config: FdiConfig) -> Fields:
    """What the sensors report now and what the filter expects; never the true errors."""
    n, readings = config.num_vehicles, config.num_readings
    furthest = config.max_range_injection_m + MAX_ERROR_GAPS * config.desired_gap_m
    fastest = config.max_rate_injection_mps + MAX_RATE_MPS
    strongest = max(config.max_acceleration_mps2, -config.min_acceleration_mps2)
    half = (readings // 2,)
    return Fields(
        Field("range_error", "m", -furthest, furthest, half, f"reported range minus x_d: {ORDER}"),
        Field("range_rate", "m/s", -fastest, fastest, half, f"reported range-rate: {ORDER}"),
        Field("range_innovation", "m", -furthest, furthest, half, f"reported minus predicted: {ORDER}"),
        Field("rate_innovation", "m/s", -fastest, fastest, half, f"reported minus predicted: {ORDER}"),
        *shared_fields(config),
        Field("command", "m/s2", -strongest, strongest, (n,), "applied in the last step"),
        Field(
            "trust", "-", 0, 1, (readings,), f"1 where the last reading was used: ranges ({ORDER}), then range-rates"
        ),
        Field("steps_left", "steps", 0, config.horizon, (), "until the horizon"),
    )


@kernel
def observe_filtered(batch: Batch, observations: Observation) -> None:
    """Fill (B, size) with `filtered_fields`."""
    values, offsets, scale = room(observations.shape[1]), batch.defender.offsets, batch.defender.scale
    for b in range(observations.shape[0]):
        fill_filtered(view(batch.state, b), constants_for(batch, b), borrowed(offsets), borrowed(values))
        encode_row(borrowed(values), borrowed(scale), borrowed(observations)[b])


@inlined
def fill_filtered(episode: State, c: Constants, offsets: Array, row: FloatArray) -> None:
    """The values (size,) of one episode in the units of the fields; `offsets` (1,) are where they begin."""
    at, half = offsets[0], c.readings // 2
    for j in range(half):
        row[at.range_error + j] = episode.reading[j]
        row[at.range_rate + j] = episode.reading[half + j]
        row[at.range_innovation + j] = innovation_of(episode, c, j)
        row[at.rate_innovation + j] = innovation_of(episode, c, half + j)
    fill_shared(episode, c, offsets, row)
    copy(episode.command, row[at.command :])
    copy(episode.trust, row[at.trust :])
    row[at.steps_left] = c.horizon - episode.step[0]


@inlined
def fill_shared(episode: State, c: Constants, offsets: Array, row: FloatArray) -> None:
    """What `shared_fields` hold."""
    n, at, half = episode.command.size, offsets[0], c.readings // 2
    if c.filters:
        copy(episode.prediction[:n], row[at.predicted_gap_error :])
        copy(episode.prediction[n:], row[at.predicted_speed :])
        for j in range(half):
            row[at.range_deviation + j] = deviation_of(episode, c, j)
            row[at.rate_deviation + j] = deviation_of(episode, c, half + j)
    if c.draws_gains:
        row[at.gain] = c.proportional_gain / c.nominal_proportional_gain
        row[at.gain + 1] = c.derivative_gain / c.nominal_derivative_gain
