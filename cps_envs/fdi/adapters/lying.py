"""What the attacker's adapters share: they see the attacked gap, and tell its sensors' readings in metres and m/s."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.holding import hold
from cps_envs.core.compute.kernels import borrowed, inlined, kernel, room
from cps_envs.core.declare.fields import Field, Fields, decode_entry, encode_row
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, State
from cps_envs.fdi.adapters.bending import COMMAND_MPS2, FILTER_DEVIATIONS, GAP_M, SPEED_MPS, bent, bent_field
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.observation import is_drawn
from cps_envs.fdi.team import sensor_gaps

SOON_S = 0.5  # an action may be kept for so long; chosen


class Sight(NamedTuple):
    """What kernels know of an attacker's observation, and of what they make of it."""

    sensors: IntArray  # (S,) readings of the action's slots
    gaps: IntArray  # (R,) the gap that each reading shows, 0 = ahead of the last vehicle
    shape: IntArray  # (3,) vehicles, horizon, whether the observation says what is attacked
    offsets: Array  # (1,) where the fields of the role begin
    scale: FloatArray  # (2, size) of their encoding
    own_offsets: Array  # (1,) where the fields of the adapter begin
    own_scale: FloatArray  # (2, m)


class Voice(NamedTuple):
    """The S slots of an action, as kernels need them."""

    ranges: BoolArray  # (S,) whether they are of ranges, else of range-rates
    resolution: FloatArray  # (S,) m or m/s
    bounds: IntArray  # (S,) the largest level


class Lying(Adapter):
    """One agent, centred on the gap of the first attacked sensor; every attacked sensor is lied about alike.

    Raises:
        ConfigurationError: there is no filter, or actions are shares of what is legal.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config: FdiConfig = spec.config
        if config.estimator != "kalman":
            raise ConfigurationError(
                'the adapter motion lies to a filter: it needs estimator = "kalman", as in preset "learning", not '
                f"{config.estimator!r}"
            )
        n, readings = config.num_vehicles, config.num_readings
        self.agents, self.fields = (spec.role,), gap_fields(config)
        marks = config.fixed_task.sensors.flags(n, rear=True)
        self.sensors: IntArray = np.arange(readings) if is_drawn(config) else np.flatnonzero(marks)  # (S,)
        self.ranges: BoolArray = self.sensors < readings // 2
        self.resolution: FloatArray = np.where(self.ranges, config.range_resolution_m, config.rate_resolution_mps)
        self.bounds: IntArray = np.where(self.ranges, config.range_levels, config.rate_levels)
        self._voice = hold(Voice(self.ranges, self.resolution, self.bounds))
        self.gaps: IntArray = np.tile(sensor_gaps(n), 2)  # (R,)
        self._sight = hold(
            Sight(
                sensors=self.sensors,
                gaps=self.gaps,
                shape=np.array([n, config.horizon, is_drawn(config)]),
                offsets=spec.fields.offsets,
                scale=spec.fields.scale,
                own_offsets=self.fields.offsets,
                own_scale=self.fields.scale,
            )
        )

    @abstractmethod
    def lies(self, seen: Seen, state: State) -> FloatArray:
        """The lies (B, 2) of now about the range, m, and the range-rate, m/s."""

    def observe(self, seen: Seen, state: State) -> Observation:
        """What `gap_fields` describe, (B, 1, m)."""
        shown = np.empty((len(seen), 1, self.fields.size), np.float32)
        observe_gap(self._sight, seen.observation, self.lies(seen, state), shown[:, 0])
        return shown

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Where injections work, or soon will, (B, 1)."""
        soon: BoolArray = seen["wait"] * self.spec.config.dt_s <= SOON_S + 1e-6
        return soon

    def attacked(self, seen: Seen) -> BoolArray:
        """The slots (B, S) of sensors under attack, also while that does not work."""
        return seen["attacked"] > 0.5 if "attacked" in seen else np.ones((len(seen), len(self.sensors)), np.bool_)

    def injected(self, seen: Seen) -> FloatArray:
        """The mean injections (B, 2) of the last step, into attacked ranges and into attacked range-rates."""
        injected, attacked = seen["injection"] * self.bounds * self.resolution, self.attacked(seen)
        kinds = (self.ranges, ~self.ranges)
        return np.stack([injected[:, k].sum(1) / np.maximum(attacked[:, k].sum(1), 1) for k in kinds], axis=1)


def gap_fields(config: FdiConfig) -> Fields:
    """The attacked gap, the one ahead of it and the one behind it; zeros for a gap that does not exist."""
    n, spot = config.num_vehicles, "the attacked gap, the next ahead, the next behind"
    return Fields(
        bent_field("gap_error", GAP_M, "m", (3,), f"e_x of {spot}"),
        bent_field("relative_speed", SPEED_MPS, "m/s", (3,), f"e_v of {spot}"),
        bent_field("command", COMMAND_MPS2, "m/s2", (3,), "commands without injection of the vehicles behind them"),
        bent_field("range_surprise", FILTER_DEVIATIONS, "deviations", (3,), "e_x minus the filter's prediction"),
        bent_field("rate_surprise", FILTER_DEVIATIONS, "deviations", (3,), "e_v minus the filter's prediction"),
        bent_field("range_lie", GAP_M, "m", (), "the lie about the range"),
        bent_field("rate_lie", SPEED_MPS, "m/s", (), "the lie about the range-rate"),
        bent_field("told_gap_error", GAP_M, "m", (), "e_x of the attacked gap plus the lie"),
        bent_field("told_speed", SPEED_MPS, "m/s", (), "e_v of the attacked gap plus the lie"),
        Field("used", "-", 0, 1, (), "share of the attacked readings that were used in the last step"),
        Field("attacked", "-", 0, 1, (3,), "whether a range is attacked, a range-rate, a rear sensor"),
        Field("gap", "-", 0, 1, (n,), "one-hot: the attacked gap, by the vehicle behind it"),
        Field("works", "-", 0, 1, (), "1 where an injection of now works"),
        Field("wait", "-", 0, math.log1p(config.horizon), (), "log(1 + steps before one does)"),
        Field("steps_left", "steps", 0, config.horizon, (), "until the horizon"),
        Field("gain", "-", 0.5, 1.5, (2 if config.gain_spread > 0 else 0,), "k_p and k_d, as parts of the configured"),
    )


@kernel
def observe_gap(sight: Sight, observation: Observation, lies: FloatArray, shown: Observation) -> None:
    """Fill (B, m) from the role's observation (B, size) and the lies (B, 2) of now."""
    values = room(shown.shape[1])
    for b in range(shown.shape[0]):
        _fill(sight, borrowed(observation)[b], borrowed(lies)[b], borrowed(values))
        encode_row(borrowed(values), borrowed(sight.own_scale), borrowed(shown)[b])


@inlined
def _fill(sight: Sight, seen: Observation, lies: FloatArray, row: FloatArray) -> None:
    """The values (m,) of one environment."""
    n, at, to = sight.shape[0], sight.offsets[0], sight.own_offsets[0]
    gap = _fill_attacked(sight, seen, row)
    for i in range(n):
        row[to.gap + i] = 1.0 if i == gap else 0.0
    for k in range(3):
        pair = gap + (k if k < 2 else -1)
        if 0 <= pair < n:
            error, speed = (
                decode_entry(seen, sight.scale, at.gap_error + pair),
                decode_entry(seen, sight.scale, at.relative_speed + pair),
            )
            off = error - decode_entry(seen, sight.scale, at.predicted_gap_error + pair)
            rate_off = speed - decode_entry(seen, sight.scale, at.predicted_speed + pair)
            row[to.gap_error + k] = bent(error, GAP_M)
            row[to.relative_speed + k] = bent(speed, SPEED_MPS)
            row[to.command + k] = bent(decode_entry(seen, sight.scale, at.command + pair), COMMAND_MPS2)
            row[to.range_surprise + k] = bent(
                off / decode_entry(seen, sight.scale, at.range_deviation + pair), FILTER_DEVIATIONS
            )
            row[to.rate_surprise + k] = bent(
                rate_off / decode_entry(seen, sight.scale, at.rate_deviation + pair), FILTER_DEVIATIONS
            )
            if k == 0:
                row[to.told_gap_error] = bent(error + lies[0], GAP_M)
                row[to.told_speed] = bent(speed + lies[1], SPEED_MPS)
        else:
            row[to.gap_error + k] = row[to.relative_speed + k] = row[to.command + k] = 0.0
            row[to.range_surprise + k] = row[to.rate_surprise + k] = 0.0
    row[to.range_lie], row[to.rate_lie] = bent(lies[0], GAP_M), bent(lies[1], SPEED_MPS)
    wait = decode_entry(seen, sight.scale, at.wait)
    row[to.works] = 1.0 if wait < 0.5 else 0.0
    row[to.wait] = math.log1p(max(wait, 0.0))
    row[to.steps_left] = decode_entry(seen, sight.scale, at.steps_left)
    for k in range(row.size - to.gain):
        row[to.gain + k] = decode_entry(seen, sight.scale, at.gain + k)


@inlined
def _fill_attacked(sight: Sight, seen: Observation, row: FloatArray) -> int:
    """Fill `attacked` and `used`; returns the gap of the first attacked sensor."""
    n, at, to, half = sight.shape[0], sight.offsets[0], sight.own_offsets[0], sight.gaps.size // 2
    row[to.attacked] = row[to.attacked + 1] = row[to.attacked + 2] = 0.0
    gap, count, used = -1, 0, 0.0
    for slot in range(sight.sensors.size):
        if sight.shape[2] == 0 or decode_entry(seen, sight.scale, at.attacked + slot) > 0.5:
            sensor = sight.sensors[slot]
            gap = sight.gaps[sensor] if gap < 0 else gap
            row[to.attacked + (0 if sensor < half else 1)] = 1.0
            if sensor % half >= n:
                row[to.attacked + 2] = 1.0
            count += 1
            used += decode_entry(seen, sight.scale, at.trust + sensor)
    row[to.used] = used / max(count, 1)
    return gap
