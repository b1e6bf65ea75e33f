"""What learners play the two roles through if they start from a controller: each action may be left to it.

Such a policy looks more often than it decides: the controller looks at every decision of the role, the learner keeps
its choice for some of them.
"""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_baselines.rogue.families import guard
from cps_baselines.rogue.guard import Guard
from cps_baselines.rogue.identify import known
from cps_baselines.rogue.monitor import NOBODY, Monitor
from cps_baselines.rogue.reading import require_one
from cps_baselines.rogue.switching import SIGNALS, switch
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, IntArray, Observation, State
from cps_envs.rogue.actions import LEVELS, choices_of
from cps_envs.rogue.adapters import Effort, Vehicle
from cps_envs.rogue.controllers import CONTROLLERS, FRONT, LINEAR, SLIDING
from cps_envs.rogue.reading import levels_of

ADVICE = 0  # the action that leaves it to the controller
ADVISOR = "monitor"  # against which `contested` was searched, where it advises
TURN = 10.0  # what an action of 1 adds to its form, chosen
SUM_MPS, STRENGTH_MPS2 = 10.0, 1.5  # bounds, chosen
NEAR = 2  # places from the suspect up to which vehicles may depart from the monitor's advice, chosen
# What they may do instead, chosen: three laws, and the hardest braking and driving that can be ordered.
MORE, LAWS = (-1, 1), (FRONT, SLIDING)  # the same, near a suspect of `guard`: levels, and laws
HOME = 1 + len(MORE) + len(LAWS)  # the action, and
HOME_S, SPEED_S, HOME_MPS = 8.0, 0.7, 10.0  # times in which vehicles come home, and to the speed for it, chosen
OPTIONS = np.array([LINEAR, SLIDING, FRONT, len(CONTROLLERS), len(CONTROLLERS) + len(LEVELS) - 1])


class Contesting(Effort):
    """The seized vehicle does what `contested` does, and turns to driving or braking sooner or later than that.

    `contested` drives in full where a form of what it sees is above zero, else it brakes in full; its weights were
    searched against `monitor`. The action, Box (1,), times `TURN` is added to the form. Zero is `contested`.

    Raises:
        ConfigurationError: several vehicles attack together.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        require_one(spec, self)
        self._weights = known().weights[known().against.index(ADVISOR)]  # (7,)
        self.action_space, self.neutral_action = spaces.Box(-1.0, 1.0, (1,), np.float32), np.zeros(1, np.float32)
        self.fields = Fields(*self.fields, Field("turned", "-", -1, 1, (), "its last effort"))

    def begin(self, num_envs: int) -> State:
        """The last efforts (B,)."""
        return (np.ones(num_envs),)

    def observe(self, seen: Seen, state: State) -> Observation:
        """The seized vehicle's row and its last effort (B, 1, m)."""
        rows = super().observe(seen, state)
        turned = np.asarray(state[0], np.float32)[:, np.newaxis, np.newaxis]
        return np.concatenate([rows, turned], axis=2)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The efforts (B, 1) from (B, 1, 1)."""
        weights = np.tile(self._weights, (len(seen), 1))
        weights[:, SIGNALS.index("one")] += TURN * actions[:, 0, 0]
        efforts = switch(seen, self.spec.config.separation_m, weights, state[0])
        return efforts.astype(np.float32)[:, np.newaxis], (efforts,)


class Monitored(Vehicle):
    """Vehicles near a suspect do what `monitor` says (0), or drive by one of `OPTIONS` (1, ...), never modified.

    Only those up to `NEAR` places from the suspect are active, while there is one. All others do what `monitor` says.
    Beside its own row a vehicle sees what the monitor holds: how much it and the most disobedient other have disobeyed,
    where the suspect is, how strong, and what it is told to do.

    Raises:
        ConfigurationError: the environment offers no accelerations beside controllers, see `vehicle`.
    """

    pauses = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        if spec.config.defense_action != "either":
            raise ConfigurationError(
                'the adapters "monitor" and "guard" need defense_action="either", as in preset learning; '
                'elsewhere take "vehicle"'
            )
        self._advisor, self._choices = self.advisor(), choices_of(spec.config)
        self.action_space, self.neutral_action = spaces.Discrete(1 + len(OPTIONS)), np.array(ADVICE)
        self.fields = Fields(
            *self.fields,
            Field("disobeyed", "m/s", 0, SUM_MPS, (), "the monitor's sum for this vehicle"),
            Field("others_disobeyed", "m/s", 0, SUM_MPS, (), "the largest sum of another one"),
            Field("strength", "m/s2", 0, STRENGTH_MPS2, (), "of the suspect, 0 if nobody is suspected"),
            Field("suspect", "-", 0, 1, (2 * NEAR + 1,), "how many places ahead the suspect is, one-hot from the rear"),
            Field("advice", "-", 0, 1, (self._choices,), "controller or acceleration that it is advised, one-hot"),
        )

    def advisor(self) -> Monitor | Guard:
        """The controller to which vehicles may leave it; what it remembers begins with sums, suspects and strengths."""
        return Monitor(self.spec)

    def begin(self, num_envs: int) -> State:
        """What the controller remembers, and what it advises (B, A)."""
        held = self._advisor.begin([np.random.default_rng()] * num_envs, [])
        assert held is not None
        return (*held, np.zeros((num_envs, len(self.agents)), np.int64))

    def active(self, seen: Seen, state: State) -> BoolArray:
        """The vehicles (B, A) near the suspect, whether or not it is one of the seized vehicle's neighbours."""
        return super().active(seen, state) & self._near(state[1])

    def _near(self, suspects: IntArray) -> BoolArray:
        """The vehicles (B, A) up to `NEAR` places from suspects (B,), without these."""
        away = np.abs(suspects[:, np.newaxis] - np.arange(len(self.agents)))
        near: BoolArray = (away > 0) & (away <= NEAR) & (suspects != NOBODY)[:, np.newaxis]
        return near

    def observe(self, seen: Seen, state: State) -> Observation:
        """The vehicles' rows (B, A, m)."""
        sums, suspects, strengths, advice = *state[:3], state[-1]
        count = len(self.agents)
        away = suspects[:, np.newaxis] - np.arange(count)
        alone = np.where(np.eye(count, dtype=np.bool_), -1.0, sums[:, np.newaxis])  # (B, A, A)
        place = np.clip(away, -NEAR, NEAR)[..., np.newaxis] == np.arange(-NEAR, NEAR + 1)
        told = (
            2 * np.minimum(np.stack([sums, alone.max(axis=2)], axis=2) / SUM_MPS, 1) - 1,
            np.broadcast_to(2 * np.minimum(strengths / STRENGTH_MPS2, 1) - 1, (count, len(seen))).T[..., np.newaxis],
            marks(place & (suspects != NOBODY)[:, np.newaxis, np.newaxis]),
            marks(advice[..., np.newaxis] == np.arange(self._choices)),
        )
        return np.concatenate([super().observe(seen, state), *told], axis=2, dtype=np.float32)

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The orders (B, 2 A)."""
        advice, held = self._advisor.act(seen, state[:-1])
        assert held is not None
        own, _ = super().act(seen, state, self.departures(seen, held[1], advice[:, ::2], actions))
        departs = np.repeat((actions != ADVICE) & self._near(held[1]), 2, axis=1)
        orders = np.where(departs, own, advice)
        return orders, (*self._advisor.told(orders, held), advice[:, ::2])

    def departures(self, seen: Seen, suspects: IntArray, advice: IntArray, actions: IntArray) -> IntArray:
        """What vehicles are ordered that depart from the advice (B, A) by actions (B, A), with suspects (B,)."""
        chosen: IntArray = OPTIONS[np.maximum(actions - 1, 0)]
        return chosen


class Guarded(Monitored):
    """Vehicles near a suspect do what `guard` says (0), or depart from it (1 to 5).

    They brake more (1) or drive more (2) by one of the five accelerations, follow (3), slide (4), or drive home (5): to
    their places, or to the open ones of `formation` where the suspect is in the way.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.action_space = spaces.Discrete(1 + HOME)
        self._levels_mps2 = levels_of(spec.config)

    def advisor(self) -> Guard:
        """See `Monitored`."""
        return guard(self.spec)

    def departures(self, seen: Seen, suspects: IntArray, advice: IntArray, actions: IntArray) -> IntArray:
        """See `Monitored`."""
        first, home, going = len(CONTROLLERS), advice.copy(), (actions == HOME).any(axis=1)
        if going.any():
            home[going] = first + self._homewards(Seen(seen.fields, seen.observation[going]), suspects[going])
        level = np.where(advice < first, len(LEVELS) // 2, advice - first)
        brake, drive = (first + np.clip(level + step, 0, len(LEVELS) - 1) for step in MORE)
        follow, slide = (np.full_like(advice, law) for law in LAWS)
        orders: IntArray = np.choose(actions, (advice, brake, drive, follow, slide, home))
        return orders

    def _homewards(self, seen: Seen, suspects: IntArray) -> IntArray:
        """The levels (B, A) that bring vehicles to their places, next to suspects (B,) where these are in the way."""
        behind_m, vehicles = self._behind(seen), np.arange(len(self.agents))
        late_m = np.take_along_axis(behind_m, np.maximum(suspects, 0)[:, np.newaxis], axis=1)
        beside_m, after = behind_m - late_m, vehicles < suspects[:, np.newaxis]
        missing_m = np.where(after, np.minimum(behind_m, beside_m), np.maximum(behind_m, beside_m))
        towards_mps = np.clip(missing_m / HOME_S, -HOME_MPS, HOME_MPS)
        wanted_mps2 = (seen["reference_speed"][:, np.newaxis] + towards_mps - seen["speed"]) / SPEED_S
        nearest: IntArray = np.abs(wanted_mps2[..., np.newaxis] - self._levels_mps2).argmin(axis=2)
        return nearest


def marks(which: BoolArray) -> Observation:
    """1 where it holds and -1 elsewhere."""
    return np.where(which, np.float32(1), np.float32(-1))
