"""Extension beyond the paper: vehicles that drive to their places, give way to the attacker, and box it in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_baselines.family import as_records
from cps_baselines.rogue.reading import read
from cps_envs.core.compute.kernels import Record, clip, inlined, kernel, unpack
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Observation, State
from cps_envs.rogue.actions import command_limits

LEAST_GAP_M = 0.2  # that the acceleration which avoids a contact is reckoned with
TOUCHING_M = 0.04  # the gap below which two vehicles count as touching: a smaller one does no damage again


class Manners(NamedTuple):
    """How the vehicles on one side of the attacker drive; accelerations count away from it."""

    wanted_m: float  # m, the wanted gap to the attacker at rest, bumper to bumper
    headway_s: float  # s, what it grows by with the own speed
    gap: float  # 1/s2, acceleration per metre of it that is missing
    closing: float  # 1/s, acceleration per m/s of closing speed
    pushed: float  # acceleration per acceleration of the attacker
    stopping: float  # acceleration per that which just avoids a contact
    pair_gap: float  # 1/s2, as `gap`, to an intact neighbor on the attacker's side
    pair_closing: float  # 1/s
    pair_pushed: float  # acceleration per acceleration of that neighbor
    place: float  # 1/s, speed towards the own place behind the reference, per metre that is missing
    speed: float  # 1/s, acceleration per m/s that is missing to the reference's speed and that one
    limit_mps: float  # m/s, the largest speed towards the own place
    near_m: float  # m, the gap to the attacker below which a vehicle comes up to it instead of giving way
    slow_mps: float  # m/s, the attacker's speed below which it is left alone
    touch_mps: float  # m/s, the wanted closing speed at the contact
    approach: float  # 1/s, what it grows by per metre of the gap; below 0 the gap may open the faster the larger it is
    mirror: float  # acceleration per acceleration of the attacker while it comes up
    grip: float  # 1/s, acceleration per m/s that is missing to it
    press: float  # m/s2, by how much the acceleration towards the attacker exceeds what keeps the contact


SIZE = len(Manners._fields)


class BoxingIn(AnalyticPolicy):
    """The neighbors of the attacker come up to it softly and hold it between them; who is far from it gives way.

    Away from the attacker all drive to their places, those behind it no faster, those ahead no slower than is safe.
    Safe is a linear law for the gap, and beside it the acceleration that just avoids a contact. Intact vehicles keep
    the separation to the neighbor on the attacker's side. A neighbor of the attacker that is near comes up to it at a
    closing speed that falls with the gap. Once both touch it, they squeeze it: a vehicle without a gap to either side
    does no damage, whatever its power. `numbers` is (38,), or (B, 38) with one set per episode: `Manners` behind the
    attacker, then `Manners` ahead of it.

    Raises:
        ConfigurationError: an environment that takes modes or does not tell who is seized, or another count of numbers.
    """

    def __init__(self, spec: RoleSpec, numbers: FloatArray) -> None:
        super().__init__(spec)
        config, sets = spec.config, np.atleast_2d(np.asarray(numbers, np.float64))
        if config.defense_action != "command" or config.hidden:
            raise ConfigurationError('boxing in needs defense_action="command" and orders="intact"')
        if sets.shape[1] != 2 * SIZE:
            raise ConfigurationError(f"{2 * SIZE} numbers were expected, got {sets.shape[1]}")
        self._behind, self._ahead = (as_records(Manners, half) for half in np.hsplit(sets, 2))
        self._sizes, self._limits = (config.separation_m, config.vehicle_length_m), command_limits(config)

    def act(self, seen: Seen, state: State | None) -> tuple[Array, State | None]:
        """The actions (B, n - 1)."""
        orders_mps2 = np.zeros((len(seen), self.spec.config.num_intact))
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale)
        _drive_all(*shown, self._behind, self._ahead, self._sizes, self._limits, orders_mps2)
        braking, driving = self._limits
        actions = orders_mps2 / np.where(orders_mps2 < 0.0, braking, driving)
        return actions.clip(-1.0, 1.0), state


@kernel
def _drive_all(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    behind: Array,
    ahead: Array,
    sizes: tuple[float, float],
    limits: tuple[float, float],
    orders_mps2: FloatArray,
) -> None:
    """Fill the orders (B, n - 1); `limits` are the hardest braking and driving, m/s2."""
    at, values, leader = offsets[0], np.empty(observation.shape[1]), orders_mps2.shape[1]
    for b in range(orders_mps2.shape[0]):
        for entry in range(values.size):
            values[entry] = read(observation, scale, b, entry)
        mine, theirs = unpack(Manners, behind, b % behind.size), unpack(Manners, ahead, b % ahead.size)
        seat, missing_m = round(values[at.attacker_index]) - 1, values[at.reference_error]
        held, rear_mps2 = boxed(values, at, seat, theirs.slow_mps, sizes), 0.0
        for i in range(leader, -1, -1):
            if i < leader:
                missing_m += values[at.gap_error + i]  # to the own place
            if held and i == seat + 1:
                home = homewards(values, at, i, 1.0, missing_m, theirs)
                free = values[at.acceleration + seat]
                rear_mps2, orders_mps2[b, i - 1] = squeeze(home, free, mine.press, theirs.press, limits)
            elif held and i == seat - 1:
                orders_mps2[b, i] = rear_mps2
            elif i > seat:
                orders_mps2[b, i - 1] = drive(values, at, i, i - 1, seat, missing_m, theirs, sizes)
            elif i < seat:
                orders_mps2[b, i] = -drive(values, at, i, i + 1, seat, -missing_m, mine, sizes)


@inlined
def boxed(values: FloatArray, at: Record, seat: int, slow_mps: float, sizes: tuple[float, float]) -> bool:
    """Whether both neighbors touch the attacker, and it is not left alone."""
    held, (separation_m, length_m) = (seat > 0) & (values[at.speed + seat] > slow_mps), sizes
    for pair in range(max(seat - 1, 0), seat + 1):
        held &= values[at.gap_error + pair] + separation_m - length_m < TOUCHING_M
    return bool(held)


@inlined
def squeeze(
    wanted: float, free: float, behind: float, ahead: float, limits: tuple[float, float]
) -> tuple[float, float]:
    """The orders (m/s2) of the neighbors behind and ahead that hold the attacker between them.

    The three keep one acceleration, as near to `wanted` as leaves both neighbors their pressures `behind` and `ahead`
    within the limits; `free` is the attacker's own acceleration.
    """
    braking, driving = limits
    together = max(min(wanted, 0.5 * (free + driving - behind)), 0.5 * (free - braking + ahead))
    balance = 2.0 * together - free
    return float(max(together, balance) + behind), float(min(together, balance) - ahead)


@inlined
def homewards(values: FloatArray, at: Record, i: int, away: float, missing_m: float, m: Manners) -> float:
    """The acceleration (m/s2) of vehicle `i` to its place and to the reference's speed; `away` is its sign."""
    towards = clip(m.place * missing_m, -m.limit_mps, m.limit_mps)
    return float(m.speed * (towards + away * (values[at.reference_speed] - values[at.speed + i])))


@inlined
def drive(
    values: FloatArray,
    at: Record,
    i: int,
    other: int,
    seat: int,
    missing_m: float,
    m: Manners,
    sizes: tuple[float, float],
) -> float:
    """The acceleration (m/s2), away from the attacker, of vehicle `i`, whose neighbor on that side is `other`."""
    away, pair = 1.0 if i > seat else -1.0, min(i, other)
    home, (separation_m, length_m) = homewards(values, at, i, away, missing_m, m), sizes
    opening, pushed = values[at.gap_rate + pair], away * values[at.acceleration + other]
    short_m = -values[at.gap_error + pair]  # of the separation
    if other != seat:
        return float(max(home, m.pair_gap * short_m - m.pair_closing * opening + m.pair_pushed * pushed))
    gap, closing = separation_m - length_m - short_m, min(opening, 0.0)
    if gap < m.near_m and values[at.speed + seat] > m.slow_mps:
        if gap < TOUCHING_M:
            return float(min(home, pushed - m.press))
        return float(m.mirror * pushed - m.grip * (opening + m.touch_mps + m.approach * gap))
    safe = m.gap * (m.wanted_m + m.headway_s * values[at.speed + i] - gap) - m.closing * opening + m.pushed * pushed
    return float(max(home, safe + m.stopping * closing * closing / (2.0 * max(gap, LEAST_GAP_M))))
