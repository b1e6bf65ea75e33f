"""What the agents of platoons see: the defender's observation, summed up for each platoon and for the road."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, fill, inlined, kernel, lend, room
from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.fields import Field, Fields, encode_row
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.fields import MAX_GAP_M
from cps_envs.disbanding.follower import HALF, Layout, count_present, decoded, find_record, silent_s

# All bounds here are chosen after what an undisturbed follower meets.
NEAR_M, FAR_M, INSIDE_M, NARROW_M = 60.0, 500.0, (4.0, 18.0), (3.0, 13.0)
WORSE, MANY = 40.0, 10.0  # points of E_v, vehicles in collisions
SILENT_S = 5.0


def platoon_fields(config: DisbandingConfig) -> tuple[Field, ...]:
    """The own row of a platoon, apart from its place; rows behind, ahead and inside are meant along the road."""
    fast, low = config.max_speed_mps, config.min_acceleration_mps2
    return (
        Field("mean_speed", "m/s", 0, fast, (), "of the platoon's vehicles"),
        Field("min_speed", "m/s", 0, fast, (), "slowest vehicle of the platoon"),
        Field("leader_gap", "m", 0, NEAR_M, (), "ahead of the leader; the bound for the front platoon"),
        Field("mean_gap", "m", *INSIDE_M, (), "inside the platoon"),
        Field("min_gap", "m", *NARROW_M, (), "inside the platoon"),
        Field("leader_closing", "m/s", -1, 1, (), "speed ahead of the leader minus its own; 0 at the front"),
        Field("mean_closing", "m/s", -0.5, 0.5, (), "the same, the mean of the others"),
        Field("mean_acceleration", "m/s2", -1, 1, (), "of the platoon's vehicles"),
        Field("min_acceleration", "m/s2", low / 2, 1, (), "of the platoon's vehicles"),
        Field("mean_law", "m/s2", -1.5, 0.5, (), "the plain law's command, clipped"),
        Field("speed_ahead", "m/s", 0, fast, (), "mean of the platoon ahead; v_d at the front"),
        Field("slowest_ahead", "m/s", 0, fast, (), "of all vehicles ahead of the platoon; v_d at the front"),
        Field("slowest_behind", "m/s", 0, fast, (), "of all vehicles behind the platoon; v_d at the rear"),
        Field("warned", "-", 0, 1, (), "share of the vehicles that have heard of a disbanded one ahead"),
        Field("record_age_s", "s", 0, 5, (), "of what they have heard, their mean; 0 if none has"),
        Field("ahead_speed", "m/s", 0, fast, (), "of the disbanded vehicle, their mean; v_d if nobody is"),
        Field("ahead_command", "m/s2", -1.5, 1, (), "final command of that vehicle, their mean; 0 if nobody is"),
        Field("ahead_distance", "m", 0, FAR_M, (), "to that vehicle, their least; the bound if nobody is"),
        Field("silence_s", "s", 0, SILENT_S, (), "since a message last came to the leader, or to one ahead: longest"),
    )


def common_fields(config: DisbandingConfig) -> tuple[Field, ...]:
    """What all platoons of a road share."""
    return (
        Field("velocity_error", "%", 0, WORSE, (), "E_v (2.8) over all vehicles so far"),
        Field("collided", "vehicles", 0, MANY, (), "involved in a collision so far"),
        Field("tau_s", "s", *_ends(bounds(config.tau_s)), (), "actuation lag"),
        Field("desired_gap_m", "m", *_ends(bounds(config.desired_gap_m)), (), "x_d"),
        Field("time_left_s", "s", 0, config.duration_s, (), "until the end"),
    )


class PlatoonRows:
    """Makes the rows of platoons, and those of roads, from a defender's observations."""

    def __init__(self, spec: RoleSpec) -> None:
        config: DisbandingConfig = spec.config
        own, common = platoon_fields(config), common_fields(config)
        place = Field("place", "-", 0, 1, (), "p / (N - 1), 0 at the front of the string")
        extremes = (
            Field("slowest", "m/s", 0, config.max_speed_mps, (), "of all vehicles of intact platoons"),
            Field("smallest_gap", "m", *NARROW_M, (), "inside intact platoons"),
            Field("intact", "-", 0.6, 1, (), "share of the platoons"),
        )
        self.fields = Fields(*own, place, *common)
        self.road_fields = Fields(*own, *extremes, *common)
        self._own, self._common = slice(0, len(own)), slice(len(own) + 1, None)
        self._layout = Layout(spec.fields.offsets, spec.fields.scale)
        self._platoons, self._size = config.max_platoons, config.vehicles_per_platoon
        self._speed, self._duration_s = config.desired_speed_mps, config.duration_s

    def observe(self, observation: Observation) -> Observation:
        """Rows (B, N, size) of the platoons, front to rear; zeros where a platoon is absent."""
        encoded = np.zeros((len(observation), self._platoons, self.fields.size), np.float32)
        known = (self._layout, self._size, self._speed, self._duration_s)
        fill_rows(observation, *known, self.fields.offsets, self.fields.scale, encoded)
        return encoded

    def intact(self, observation: Observation) -> BoolArray:
        """The platoons (B, N) that corrections reach."""
        intact = np.zeros((len(observation), self._platoons), np.bool_)
        mark_intact(observation, self._layout, self._size, intact)
        return intact

    def observe_road(self, observation: Observation) -> Observation:
        """Rows (B, 1, size): the means over intact platoons and their extremes."""
        rows, intact = self.observe(observation), self.intact(observation)[:, :, np.newaxis]
        count = np.maximum(intact.sum(axis=1), 1)
        means = np.where(intact, rows[:, :, self._own], 0.0).sum(axis=1) / count
        lowest = np.where(intact, rows, 1.0).min(axis=1)
        at, entry = self.fields.offsets[0], self.road_fields.slices["intact"].start
        middle, half = self.road_fields.scale[:, entry]
        share = np.clip((intact.mean(axis=(1, 2)) - middle) / half, -1.0, 1.0)
        extremes = np.stack([lowest[:, at["min_speed"]], lowest[:, at["min_gap"]], share], axis=1)
        together = np.concatenate([means, extremes, rows[:, 0, self._common]], axis=1)
        return together.astype(np.float32)[:, np.newaxis]


@kernel
def mark_intact(observation: Observation, layout: Layout, size: int, intact: BoolArray) -> None:
    """Mark the platoons (B, N) whose last vehicle a correction would reach."""
    seen = lend(layout)
    at, vehicles = seen.offsets[0], intact.shape[1] * size
    first = vehicles - (at.warned - at.mitigable)
    for b in range(intact.shape[0]):
        for platoon in range(intact.shape[1]):
            q = (platoon + 1) * size - 1
            entry = at.mitigable + max(q - first, 0)
            intact[b, platoon] = q >= first and decoded(borrowed(observation)[b], seen.scale, entry) > HALF


@kernel
def fill_rows(
    observation: Observation,
    layout: Layout,
    size: int,
    desired_speed_mps: float,
    duration_s: float,
    offsets: Array,
    scale: FloatArray,
    encoded: Observation,
) -> None:
    """Fill `encoded` (B, N, size of the row), of the fields at `offsets` with `scale`."""
    to, seen, most = borrowed(offsets)[0], lend(layout), encoded.shape[1]
    at, values, speeds = seen.offsets[0], room(encoded.shape[2]), room((2, most))
    fill(values, 0.0)
    drawn = at.time_s > at.present
    for b in range(encoded.shape[0]):
        row = borrowed(observation)[b]
        platoons = count_present(row, at, seen.scale) if drawn else most
        for platoon in range(platoons):
            sum_up_speeds(row, seen, platoon, size, speeds)
        values[to.velocity_error] = decoded(row, seen.scale, at.velocity_error)
        values[to.collided] = decoded(row, seen.scale, at.collided)
        values[to.tau_s] = decoded(row, seen.scale, at.tau_s)
        values[to.desired_gap_m] = decoded(row, seen.scale, at.desired_gap_m)
        values[to.time_left_s] = duration_s - decoded(row, seen.scale, at.time_s)
        values[to.silence_s] = 0.0
        for platoon in range(platoons):
            values[to.silence_s] = max(values[to.silence_s], silent_s(row, seen, platoon * size, size))
            values[to.place] = platoon / max(platoons - 1, 1)
            fill_speeds(speeds, platoon, platoons, desired_speed_mps, values, to)
            fill_motion(row, seen, platoon, size, values, to)
            fill_told(row, seen, platoon, size, desired_speed_mps, values, to)
            encode_row(values, borrowed(scale), borrowed(encoded)[b, platoon])


@inlined
def sum_up_speeds(row: Observation, layout: Layout, platoon: int, size: int, speeds: FloatArray) -> None:
    """Mean and least speed of a platoon, into `speeds` (2, N)."""
    total, slowest = 0.0, np.inf
    for q in range(platoon * size, (platoon + 1) * size):
        speed = decoded(row, layout.scale, layout.offsets[0].speed + q)
        total += speed
        slowest = min(slowest, speed)
    speeds[0, platoon], speeds[1, platoon] = total / size, slowest


@inlined
def fill_speeds(speeds: FloatArray, platoon: int, platoons: int, v_d: float, values: FloatArray, to: Record) -> None:
    """The speeds of a platoon and of those around it, given all of them (2, N)."""
    values[to.mean_speed], values[to.min_speed] = speeds[0, platoon], speeds[1, platoon]
    values[to.speed_ahead] = speeds[0, platoon - 1] if platoon > 0 else v_d
    ahead, behind = v_d, v_d
    for other in range(platoons):
        if other < platoon:
            ahead = min(ahead, speeds[1, other])
        elif other > platoon:
            behind = min(behind, speeds[1, other])
    values[to.slowest_ahead], values[to.slowest_behind] = ahead, behind


@inlined
def fill_motion(row: Observation, layout: Layout, platoon: int, size: int, values: FloatArray, to: Record) -> None:
    """Gaps, closing speeds and accelerations of a platoon."""
    at, scale, first = layout.offsets[0], layout.scale, platoon * size
    values[to.leader_gap], values[to.leader_closing] = MAX_GAP_M, 0.0
    if platoon > 0:
        values[to.leader_gap] = decoded(row, scale, at.gap + first - 1)
        values[to.leader_closing] = decoded(row, scale, at.relative_speed + first - 1)
    gaps, least, closing, acceleration, hardest, law = 0.0, np.inf, 0.0, 0.0, np.inf, 0.0
    for q in range(first, first + size):
        if q > first:
            gap = decoded(row, scale, at.gap + q - 1)
            gaps += gap
            least = min(least, gap)
            closing += decoded(row, scale, at.relative_speed + q - 1)
        own = decoded(row, scale, at.acceleration + q)
        acceleration += own
        hardest = min(hardest, own)
        law += decoded(row, scale, at.law_command + q)
    values[to.mean_gap], values[to.min_gap], values[to.mean_closing] = gaps / (size - 1), least, closing / (size - 1)
    values[to.mean_acceleration], values[to.min_acceleration] = acceleration / size, hardest
    values[to.mean_law] = law / size


@inlined
def fill_told(
    row: Observation, layout: Layout, platoon: int, size: int, v_d: float, values: FloatArray, to: Record
) -> None:
    """What the vehicles of a platoon are told of the disbanded vehicle ahead."""
    at, scale, told = layout.offsets[0], layout.scale, 0
    age_s, speed, command, distance = 0.0, 0.0, 0.0, np.inf
    for q in range(platoon * size, (platoon + 1) * size):
        place, old_s = find_record(row, layout, q, size)
        if place >= 0:
            told += 1
            age_s += old_s
            speed += decoded(row, scale, at.ahead_speed + place)
            command += decoded(row, scale, at.ahead_command + place)
            distance = min(distance, decoded(row, scale, at.ahead_distance + place))
    values[to.warned] = told / size
    values[to.record_age_s], values[to.ahead_command] = age_s / max(told, 1), command / max(told, 1)
    values[to.ahead_speed] = speed / told if told > 0 else v_d
    values[to.ahead_distance] = min(distance, FAR_M)


def _ends(interval: tuple[float, float]) -> tuple[float, float]:
    """The interval, or around it where it is a number."""
    low, high = interval
    return (low, high) if low < high else (0.5 * low, 1.5 * low)
