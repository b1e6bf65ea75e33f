"""How learners drive the platoon: they say to whom all others give way, one agent for all or one for each vehicle."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from cps_envs.core.compute.kernels import clip, kernel, pack, room, unpack
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, State
from cps_envs.rogue.actions import bodies_of
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.fields import NEAR, compressed
from cps_envs.rogue.giving_way import NOBODY, GivingWay, Ways
from cps_envs.rogue.obedience import disobedience
from cps_envs.rogue.reading import commanded, read, vehicles
from cps_envs.rogue.state import Rules, rules_of
from cps_envs.rogue.swarm import names_of

NEUTRAL = 0  # nobody asks
CONFIRMED_S = 1.0  # chosen: without a break, before a vehicle is given way
WAYS = Ways(  # chosen: round numbers near those that a search found for `escort`
    gap_gain=0.5,  # measured and expected gaps count alike
    rate_gain=0.5,  # and so do gap rates
    speed=5.0,  # a speed is corrected in 0.2 s
    place=0.03,  # a place is reached again in half a minute
    limit_mps=50.0,  # no limit in practice
    pair_gap=1.0,  # an intact neighbor behind that is 1 m too near counts as 1 m/s2
    pair_closing=5.0,  # and its closing speed is taken up in 0.2 s
    allowed_mps=0.5,  # within the noise of gap rates
    stopping=10.0,  # it drives away at once, and not at the last moment
    wanted_m=2.0,  # a gap is left
    pushed=0.0,  # what the vehicle behind does is not copied
    near_m=8.0,  # nearly twice the gap between bumpers at rest
    slow_mps=8.0,  # from there a run-up takes long
    touch_mps=3.0,  # see the next but one
    approach=1.0,  # see the next
    most_mps=0.0,  # the nearest wants no closing speed at all
    grip=15.0,  # whatever closes is answered in full
    mirror=1.0,  # the acceleration behind is copied
    home=0.5,  # half of what would bring it home is added
)
MARGIN_MPS, SLACK_MPS2 = 1.0, 2.0  # chosen: two deviations of the noise of gap rates, and one of accelerations
MOST_MPS, LATELY_MPS = 20.0, 2.0  # chosen: sums forget in 10 s and in 1 s at the latest
FAR_M, FAST_MPS = 60.0, 25.0  # chosen: from there on errors look alike


class GiveWayVehicle(Adapter):
    """One agent for each vehicle: all others give way to it (1), or not (0).

    At most one vehicle is given way at a time. The first stays while its agent says 1, and another one follows only
    after it has said 1 for `CONFIRMED_S` without a break. Where nobody is given way, all drive by the sliding mode.
    A row is about its vehicle as the platoon sees it, so all agents can share a network.

    Raises:
        ConfigurationError: what `GivingWay` refuses.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        config: RogueConfig = spec.config
        self._giving, self._count = GivingWay(spec, pack(WAYS)), config.num_orders
        self._rules, self._bodies = rules_of(config), bodies_of(config)
        self.agents: tuple[str, ...] = names_of(config)
        self.action_space: spaces.Space[Any] = spaces.Discrete(2)
        self.neutral_action = np.array(NEUTRAL)
        self.fields = Fields(
            *about_vehicles(()),
            Field("others_disobeyed", "m/s", 0, MOST_MPS, (), "the largest of the others"),
            Field("others_lately", "m/s", 0, LATELY_MPS, (), "the same with `lately`"),
            Field("given", "-", 0, 1, (), "the others give way to it"),
            Field("other_given", "-", 0, 1, (), "to somebody else is given way"),
            Field("asked_s", "s", 0, 2 * CONFIRMED_S, (), "for how long it has asked without a break"),
            Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
        )

    def begin(self, num_envs: int) -> State:
        """The sums `disobeyed` and `lately` (B, n), accelerations (B, n) that were commanded, NaN where a law was.

        Then the gaps and gap rates (B, n - 1) as they are filtered, for how many decisions each vehicle has asked
        (B, n), and who is given way (B,).
        """
        shape, gaps = (num_envs, self._count), self._giving.unfiltered(num_envs)
        asked, nobody = np.zeros(shape, np.int64), np.full(num_envs, NOBODY)
        return np.zeros(shape), np.zeros(shape), np.full(shape, np.nan), gaps, gaps.copy(), asked, nobody

    def observe(self, seen: Seen, state: State) -> Observation:
        """The rows (B, n, m)."""
        sums, (asked, given) = state[:2], state[-2:]
        marked = given[:, np.newaxis] == np.arange(self._count)
        others = [np.where(np.eye(self._count, dtype=np.bool_), 0.0, s[:, np.newaxis]).max(axis=2) for s in sums]
        somebody_else = marked.any(axis=1, keepdims=True) & ~marked
        time_s = np.broadcast_to(seen["time_left_s"][:, np.newaxis], marked.shape)
        asked_s = asked * self.spec.decision_interval_s
        own = (*self._about(seen, state), *others, marked, somebody_else, asked_s, time_s)
        rows = self.fields.encode(np.stack(own, axis=2).reshape(-1, len(own)))
        return rows.reshape(len(seen), self._count, -1)

    def active(self, seen: Seen, state: State) -> BoolArray:
        """The vehicles (B, n) that the platoon has; which of them is seized the defender does not know."""
        return self._there(seen)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The orders (B, 2 n)."""
        sums, lately, told, gaps, rates, asked, given = state
        sums, lately = sums.copy(), lately.copy()
        shown = (seen.observation, seen.fields.offsets, seen.fields.scale)
        _watch(*shown, told, self.spec.decision_interval_s, self._rules, self._bodies, sums, lately)
        asks = self._asks(actions, sums, given) & self._there(seen)
        asked = np.where(asks, asked + 1, 0)
        given = self._given(asked, given)
        orders, gaps, rates = self._giving.orders(seen, given, gaps, rates, returning=True)
        return orders, (sums, lately, commanded(orders, self.spec.config), gaps, rates, asked, given)

    def _asks(self, actions: Array, sums: FloatArray, given: IntArray) -> BoolArray:
        """Which vehicles (B, n) ask to be given way."""
        asks: BoolArray = actions != NEUTRAL
        return asks

    def _given(self, asked: IntArray, given: IntArray) -> IntArray:
        """Who is given way (B,) after who was; vehicles have asked for so many decisions (B, n)."""
        stays = (given != NOBODY) & (asked[np.arange(len(given)), given] > 0)
        waited = np.where((asked - 0.5) * self.spec.decision_interval_s > CONFIRMED_S, asked, 0)
        longest = np.where(waited.any(axis=1), waited.argmax(axis=1), NOBODY)
        return np.where(stays, given, longest)

    def _there(self, seen: Seen) -> BoolArray:
        places, extra = np.arange(self._count), seen["present"]
        there: BoolArray = places - self._count < extra.sum(axis=1, keepdims=True) - extra.shape[1] - 0.5
        return there

    def _about(self, seen: Seen, state: State) -> tuple[Array, ...]:
        """What `about_vehicles` shows of each vehicle, each (B, n)."""
        there, sides = self._there(seen), np.zeros((2, len(seen), self._count + 1))
        sides[:, :, 1:-1] = np.where(there[:, 1:], compressed(np.stack([seen["gap_error"], seen["gap_rate"]])), 0.0)
        (errors, rates), speed = sides, seen["speed"] - seen["reference_speed"][:, np.newaxis]
        return (*state[:2], errors[:, :-1], rates[:, :-1], errors[:, 1:], rates[:, 1:], np.where(there, speed, 0.0))


class GiveWay(GiveWayVehicle):
    """One agent for the platoon: give way to the suspect (1), or not (0).

    The suspect is the vehicle that is given way; where there is none, the one that has disobeyed most. An agent that
    says 1 from the start on gives way to somebody honest, and stays with it. It says 0 and then 1 to change its mind.
    All else is as in `GiveWayVehicle`.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.agents = (spec.role,)
        self.fields = Fields(
            *about_vehicles((2,)),
            Field("given", "-", 0, 1, (), "the suspect is given way"),
            Field("time_left_s", "s", 0, spec.config.duration_s, (), "until the end of the episode"),
        )

    def observe(self, seen: Seen, state: State) -> Observation:
        """The platoon's row (B, 1, m)."""
        sums, given = state[0], state[-1]
        two = np.stack(_suspects(sums, given), axis=1)
        about = [np.take_along_axis(values, two, axis=1) for values in self._about(seen, state)]
        whole = np.stack([given != NOBODY, seen["time_left_s"]], axis=1)
        return self.fields.encode(np.concatenate([*about, whole], axis=1))[:, np.newaxis]

    def active(self, seen: Seen, state: State) -> BoolArray:
        """The agent, always."""
        return np.ones((len(seen), 1), np.bool_)

    def _asks(self, actions: Array, sums: FloatArray, given: IntArray) -> BoolArray:
        """The suspect asks (B, n)."""
        suspect, _ = _suspects(sums, given)
        asks: BoolArray = (suspect[:, np.newaxis] == np.arange(self._count)) & (actions != NEUTRAL)
        return asks


def _suspects(sums: FloatArray, given: IntArray) -> tuple[IntArray, IntArray]:
    """The suspect and the next one (B,), see `GiveWay`, by the sums (B, n) and by who is given way (B,)."""
    suspect = np.where(given == NOBODY, sums.argmax(axis=1), given)
    following = np.where(suspect[:, np.newaxis] == np.arange(sums.shape[1]), -1.0, sums).argmax(axis=1)
    return suspect, following


def about_vehicles(shape: tuple[int, ...]) -> tuple[Field, ...]:
    """What learners see of a vehicle, or of each in an array of them."""
    far, fast = (float(compressed(np.array(most))) for most in (FAR_M, FAST_MPS))
    error, rate = f"arsinh of the error in {NEAR:g} m", f"arsinh of the rate in {NEAR:g} m/s"
    return (
        Field("disobeyed", "m/s", 0, MOST_MPS, shape, "accelerations beyond its orders, summed up"),
        Field("lately", "m/s", 0, LATELY_MPS, shape, f"the same, up to {LATELY_MPS:g} m/s: it forgets in 1 s"),
        Field("rear_gap_error", "-", -far, far, shape, f"{error}; 0 if nobody is behind"),
        Field("rear_gap_rate", "-", -fast, fast, shape, f"{rate}; 0 if nobody is behind"),
        Field("front_gap_error", "-", -far, far, shape, f"{error}; 0 if nobody is ahead"),
        Field("front_gap_rate", "-", -fast, fast, shape, f"{rate}; 0 if nobody is ahead"),
        Field("speed_error", "m/s", -FAST_MPS, FAST_MPS, shape, "speed minus v_ref"),
    )


@kernel
def _watch(
    observation: Observation,
    offsets: Array,
    scale: FloatArray,
    commanded_mps2: FloatArray,
    interval_s: float,
    rules: Array,
    bodies: Array,
    sums: FloatArray,
    lately: FloatArray,
) -> None:
    """Bring both sums (B, n) up to date; accelerations (B, n) were commanded, NaN where a vehicle drives by a law."""
    at, r, values = offsets[0], unpack(Rules, rules, 0), room(observation.shape[1])
    for b in range(sums.shape[0]):
        for entry in range(values.size):
            values[entry] = read(observation, scale, b, entry)
        count = vehicles(values, at, sums.shape[1])
        for i in range(count):
            beyond = disobedience(values, at, i, count, commanded_mps2[b, i], MARGIN_MPS, r, bodies)
            gained = interval_s * (beyond - SLACK_MPS2)
            sums[b, i] = clip(sums[b, i] + gained, 0.0, MOST_MPS)
            lately[b, i] = clip(lately[b, i] + gained, 0.0, LATELY_MPS)
