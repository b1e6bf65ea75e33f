"""A platoon that gives way to one of its vehicles: those behind it follow, those ahead drive by accelerations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, clip, inlined, kernel, room, unpack
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, IntArray, Observation
from cps_envs.rogue.controllers import CONTROLLERS, FRONT, SLIDING
from cps_envs.rogue.reading import levels_of, nearest, read, vehicles
from cps_envs.rogue.state import of_vehicle

NOBODY = -1  # the seat while nobody is given way
LEAST_GAP_M = 0.5  # that the acceleration which avoids an impact is reckoned with
FASTEST_MPS = 3.5  # a vehicle ahead mirrors one that comes no faster; it gives way to others

# Of a vehicle that returns to its place, chosen:
CLOSED_S, OPENING_MPS = 2.0, 2.0  # the gap opens while its rate and its error over 2 s add up to more than 2 m/s
RETURN_S, RETURN_MPS = 8.0, 10.0  # it returns in 8 s, and at 10 m/s at the most
SPEED_S = 0.7  # it has this speed after 0.7 s


class Ways(NamedTuple):
    """How the vehicles ahead of the one that is given way drive."""

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
    near_m: float  # gap below which the nearest vehicle ahead mirrors the one that is given way
    slow_mps: float  # the speed of that one below which it is left alone
    touch_mps: float  # closing speed that the nearest wants at the contact
    approach: float  # 1/s, what it grows by per metre of the gap
    most_mps: float  # and the largest
    grip: float  # 1/s, acceleration per m/s that is missing to it
    mirror: float  # acceleration per acceleration of the one that is given way
    home: float  # share of the acceleration to the own place


class GivingWay:
    """The orders of a platoon that gives way. Its methods are pure.

    Nobody ahead lets the vehicle behind it come up faster than it can avoid. The nearest ahead mirrors the acceleration
    of one that is near, so that no gap opens for a run-up. A slow one is left alone. The accelerations are among
    `actions.LEVELS`. Measured gaps and gap rates are filtered. `ways` are records of `Ways`, one or (B,).

    Raises:
        ConfigurationError: the environment offers no accelerations beside the controllers, or marks the seized vehicle.
    """

    def __init__(self, spec: RoleSpec, ways: Array) -> None:
        config = spec.config
        if config.defense_action != "either" or not config.hidden:
            raise ConfigurationError(
                'giving way needs defense_action="either" and orders="all", as in preset learning; elsewhere take the '
                'adapter "vehicle"'
            )
        self._ways, self._levels_mps2, self._orders = ways, levels_of(config), config.num_orders
        self._bumpers_m, self._interval_s = config.separation_m - config.pair_length_m, spec.decision_interval_s

    def orders(
        self, seen: Seen, seats: IntArray, gaps: FloatArray, rates: FloatArray, *, returning: bool = False
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """The orders (B, 2 n) where `seats` (B,) are given way, and gaps and rates (B, n - 1) as they are filtered.

        Where a seat is `NOBODY`, all drive by the sliding mode. With `returning` the vehicle just behind the one that
        is given way need not follow it beyond its own place: while their gap opens, it returns there.
        """
        gaps, rates, orders = gaps.copy(), rates.copy(), np.zeros((len(seen), 2 * self._orders), np.int64)
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale)
        given = (*shown, self._ways, self._levels_mps2, self._bumpers_m, self._interval_s, seats, returning)
        _give_way_all(*given, gaps, rates, orders)
        return orders, gaps, rates

    def unfiltered(self, count: int) -> FloatArray:
        """The gaps, or the rates, (count, n - 1) of episodes that begin."""
        return np.full((count, self._orders - 1), np.nan)


@kernel
def _give_way_all(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    ways: Array,
    levels_mps2: FloatArray,
    bumpers_m: FloatArray,
    interval_s: float,
    seats: IntArray,
    returning: bool,
    gaps: FloatArray,
    rates: FloatArray,
    orders: IntArray,
) -> None:
    """Filter gaps and rates (B, n - 1) and fill the orders (B, 2 n); `seats` are `NOBODY` where all slide.

    `bumpers_m` are the wanted gaps of the pairs (n - 1,), or (1,) where all are alike.
    """
    at, values = offsets[0], room(observation.shape[1])
    for b in range(seats.size):
        w, seat = unpack(Ways, ways, b % ways.size), seats[b]
        for entry in range(values.size):
            values[entry] = read(observation, scale, b, entry)
        count = vehicles(values, at, orders.shape[1] // 2)
        for pair in range(count - 1):
            track(values, at, pair, of_vehicle(bumpers_m, pair), interval_s, w, gaps[b], rates[b])
        missing_m, late_m = values[at.reference_error], 0.0  # to the own place; of the one that is given way
        for pair in range(max(seat, 0), count - 1):
            late_m += gaps[b, pair] - of_vehicle(bumpers_m, pair)
        late_m += missing_m
        for i in range(count - 1, -1, -1):
            if i < count - 1:
                missing_m += gaps[b, i] - of_vehicle(bumpers_m, i)
            orders[b, 2 * i] = SLIDING if seat < 0 else FRONT
            if i > seat >= 0:
                open_m = max(missing_m, missing_m - late_m)
                wanted = evade(values, at, i, seat, open_m, of_vehicle(bumpers_m, i - 1), w, gaps[b], rates[b])
                orders[b, 2 * i] = len(CONTROLLERS) + nearest(levels_mps2, wanted)
            elif i < seat:
                opening = (gaps[b, i] - of_vehicle(bumpers_m, i)) / CLOSED_S + rates[b, i]
                if returning and i == seat - 1 and late_m < 0.0 and opening > OPENING_MPS:
                    wanted = go_back(values, at, i, missing_m)
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
    """The acceleration (m/s2) of vehicle `i`, ahead of the one that is given way, and `missing_m` behind its place."""
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


@inlined
def go_back(values: FloatArray, at: Record, i: int, missing_m: float) -> float:
    """The acceleration (m/s2) of vehicle `i`, `missing_m` behind its place, that brings it there."""
    towards = clip(missing_m / RETURN_S, -RETURN_MPS, RETURN_MPS)
    return float((values[at.reference_speed] + towards - values[at.speed + i]) / SPEED_S)
