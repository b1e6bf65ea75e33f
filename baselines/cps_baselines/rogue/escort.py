"""Extension beyond the paper: a defender that is told who is seized, and gives way to it by accelerations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.family import as_records
from cps_baselines.rogue.reading import levels_of, nearest, read, vehicles
from cps_envs.core.compute.kernels import Record, clip, inlined, kernel, unpack
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, Observation, State
from cps_envs.rogue.controllers import CONTROLLERS, FRONT, SLIDING

NOBODY = -1  # the seat while nobody attacks
LEAST_GAP_M = 0.5  # that the acceleration which avoids an impact is reckoned with
FASTEST_MPS = 3.5  # a vehicle ahead mirrors an attacker that comes no faster; it gives way to others


class Ways(NamedTuple):
    """How the vehicles ahead of the attacker drive."""

    gap_gain: float  # how far a measured gap corrects the expected one
    rate_gain: float  # the same of gap rates
    speed: float  # 1/s, acceleration per m/s that is missing to the reference's speed and to `place`
    place: float  # 1/s, speed towards the own place behind the reference, per metre that is missing
    limit_mps: float  # the largest of these speeds
    pair_gap: float  # 1/s2, acceleration per metre that is missing to an intact neighbor behind
    pair_closing: float  # 1/s, acceleration per m/s of its closing speed
    allowed_mps: float  # closing speed that needs no giving way
    stopping: float  # acceleration per that which just avoids an impact above the allowed speed
    wanted_m: float  # gap that is left then
    pushed: float  # acceleration per acceleration of the vehicle behind
    near_m: float  # gap below which the neighbor of the attacker mirrors it
    slow_mps: float  # the attacker's speed below which it is left alone
    touch_mps: float  # closing speed that the neighbor wants at the contact
    approach: float  # 1/s, what it grows by per metre of the gap
    most_mps: float  # and the largest
    grip: float  # 1/s, acceleration per m/s that is missing to it
    mirror: float  # acceleration per acceleration of the attacker
    home: float  # share of the acceleration to the own place


class Escort(AnalyticPolicy):
    """From the onset on, vehicles ahead of the attacker give way to it, and those behind it follow.

    Nobody ahead lets the vehicle behind it come up faster than it can avoid. The neighbor of an attacker that is near
    mirrors its acceleration, so that no gap opens for a run-up. A slow attacker is left alone. It is told the seat and
    the onset, orders one of the accelerations of `LEVELS`, and filters what it measures of the gaps. `numbers` is
    (19,), or (B, 19) with one set per episode: `Ways`.

    Raises:
        ConfigurationError: the environment offers no accelerations beside the controllers, or marks the seized vehicle.
    """

    privileged = frozenset({"truth"})

    def __init__(self, spec: RoleSpec, numbers: FloatArray) -> None:
        super().__init__(spec)
        config = spec.config
        if config.defense_action != "either" or not config.hidden:
            raise ConfigurationError('an escort needs defense_action="either" and orders="all", as in preset learning')
        self._ways = as_records(Ways, numbers)
        self._levels_mps2 = levels_of(config)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The seats (B,), the onsets (B,) in s, and the gaps and rates (B, n - 1) as they are filtered."""
        truths = [known["truth"] for known in knowledge]
        seats, onsets_s = (np.array([truth[name] for truth in truths]) for name in ("seat", "onset_s"))
        return seats, onsets_s, self.unfiltered(len(truths)), self.unfiltered(len(truths))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The orders (B, 2 n) of all vehicles."""
        seats, onsets_s, gaps, rates = state
        since_s = self.spec.config.duration_s - seen["time_left_s"]
        attacked = since_s > onsets_s - self.spec.decision_interval_s / 2
        orders, gaps, rates = self.give_way(seen, np.where(attacked, seats, NOBODY), gaps, rates)
        return orders, (seats, onsets_s, gaps, rates)

    def give_way(
        self, seen: Seen, seats: IntArray, gaps: FloatArray, rates: FloatArray
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """The orders (B, 2 n) where the vehicles `seats` (B,) attack, and the gaps and rates (B, n - 1) filtered."""
        config = self.spec.config
        gaps, rates, orders = gaps.copy(), rates.copy(), np.zeros((len(seen), 2 * config.num_orders), np.int64)
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale)
        sizes = (config.separation_m, config.vehicle_length_m, self.spec.decision_interval_s)
        _escort_all(*shown, self._ways, self._levels_mps2, sizes, seats, gaps, rates, orders)
        return orders, gaps, rates

    def unfiltered(self, count: int) -> FloatArray:
        """The gaps, or the rates, (count, n - 1) of episodes that begin."""
        return np.full((count, self.spec.config.num_orders - 1), np.nan)


@kernel
def _escort_all(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    ways: Array,
    levels_mps2: FloatArray,
    sizes: tuple[float, float, float],
    seats: IntArray,
    gaps: FloatArray,
    rates: FloatArray,
    orders: IntArray,
) -> None:
    """Filter gaps and rates (B, n - 1) and fill the orders (B, 2 n); `seats` are `NOBODY` where nobody attacks yet."""
    at, values, (separation_m, length_m, interval_s) = offsets[0], np.empty(observation.shape[1]), sizes
    bumpers_m = separation_m - length_m
    for b in range(seats.size):
        w, seat = unpack(Ways, ways, b % ways.size), seats[b]
        for entry in range(values.size):
            values[entry] = read(observation, scale, b, entry)
        count = vehicles(values, at, orders.shape[1] // 2)
        for pair in range(count - 1):
            track(values, at, pair, bumpers_m, interval_s, w, gaps[b], rates[b])
        missing_m, late_m = values[at.reference_error], 0.0  # to the own place; of the attacker
        for pair in range(max(seat, 0), count - 1):
            late_m += gaps[b, pair] - bumpers_m
        late_m += missing_m
        for i in range(count - 1, -1, -1):
            if i < count - 1:
                missing_m += gaps[b, i] - bumpers_m
            orders[b, 2 * i] = SLIDING if seat < 0 else FRONT
            if i > seat >= 0:
                open_m = max(missing_m, missing_m - late_m)
                wanted = evade(values, at, i, seat, open_m, bumpers_m, w, gaps[b], rates[b])
                orders[b, 2 * i] = len(CONTROLLERS) + nearest(levels_mps2, wanted)


@inlined
def track(
    values: FloatArray,
    at: Record,
    pair: int,
    bumpers_m: float,
    interval_s: float,
    w: Record,
    gaps: FloatArray,
    rates: FloatArray,
) -> None:
    """Bring the gap (m, between bumpers) and the gap rate (m/s) of a pair up to date."""
    gap, rate = values[at.gap_error + pair] + bumpers_m, values[at.gap_rate + pair]
    if np.isnan(gaps[pair]):
        gaps[pair], rates[pair] = gap, rate
        return
    expected = rates[pair] + interval_s * (values[at.acceleration + pair + 1] - values[at.acceleration + pair])
    there = gaps[pair] + 0.5 * interval_s * (rates[pair] + expected)
    rates[pair] = expected + w.rate_gain * (rate - expected)
    gaps[pair] = max(there + w.gap_gain * (gap - there), 0.0)


@inlined
def evade(
    values: FloatArray,
    at: Record,
    i: int,
    seat: int,
    missing_m: float,
    bumpers_m: float,
    w: Record,
    gaps: FloatArray,
    rates: FloatArray,
) -> float:
    """The acceleration (m/s2) of vehicle `i`, which is ahead of the attacker and `missing_m` behind its place."""
    towards = clip(w.place * missing_m, -w.limit_mps, w.limit_mps)
    home = w.speed * (values[at.reference_speed] + towards - values[at.speed + i])
    gap, closing, behind_mps2 = gaps[i - 1], -rates[i - 1], values[at.acceleration + i - 1]
    beside = i == seat + 1
    if beside and gap < w.near_m and closing < FASTEST_MPS and values[at.speed + seat] > w.slow_mps:
        wanted_mps = min(w.most_mps, w.touch_mps + w.approach * gap)
        return float(w.mirror * behind_mps2 - w.grip * (wanted_mps - closing) + w.home * home)
    if not beside:
        home = max(home, w.pair_gap * (bumpers_m - gap) + w.pair_closing * closing)
    beyond = closing - w.allowed_mps
    if beyond > 0.0:
        left_m = max(gap - w.wanted_m, LEAST_GAP_M)
        home = max(home, w.pushed * behind_mps2 + w.stopping * beyond * beyond / (2.0 * left_m))
    return float(home)
