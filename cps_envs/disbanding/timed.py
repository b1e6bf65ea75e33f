"""What an attacker learns through that says when to strike next, instead of deciding anew each second."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from gymnasium import spaces

from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.policies.adapter import Adapter
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, IntArray, Observation, State

DELAYS_S = np.array([0, 1, 2, 3, 5, 8, 12, 16, 20, 25, 30, 40, 50, 60, 80, 100])  # chosen
IDLE = -1
HALF = 0.5  # of an entry that is 0 or 1
NO_JAM, BEFORE, AFTER = 0, 1, 2  # a second before the strike, or after it


class Timed(Adapter):
    """One agent with up to three choices: in how many seconds, what then, and whether to jam the radio with it.

    What: 0 to look again by then, or the platoon i (1 = rear) to disband. The jam blocks the link behind that platoon,
    a second before it is disbanded or after. It is left out where it is not legal.

    What is chosen is done at that time, or as soon after as it is legal, and until then nothing else can be chosen.
    An attack that comes once in a minute would otherwise be improbable in every single second, and a policy that
    always takes its most probable action would never attack.
    """

    delays_s: ClassVar[IntArray] = DELAYS_S
    masked = True
    pauses = True
    waits = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.agents = (spec.role,)
        self._longest_s = float(self.delays_s[-1])
        self.fields = Fields(
            *spec.fields,
            Field("plans", "-", 0, 1, (), "something is chosen and not done yet"),
            Field("due_in_s", "s", 0, self._longest_s, (), "until it is done"),
        )
        self._own = Fields(*list(self.fields)[-2:])
        self._platoons = int(spec.config.max_platoons)
        self._choices = [len(self.delays_s), self._platoons + 1, *([AFTER + 1] if spec.config.can_jam else [])]
        self.action_space = spaces.MultiDiscrete(self._choices)
        self.neutral_action = np.zeros(len(self._choices), np.int64)

    def begin(self, num_envs: int) -> State:
        """Seconds until the plan is due (B,), below 0 without one, whom it disbands (B,), and which jam is due (B,)."""
        return np.full(num_envs, IDLE), np.zeros(num_envs, np.int64), np.zeros(num_envs, np.int64)

    def observe(self, seen: Seen, state: State) -> Observation:
        """The attacker's observation and its plan, (B, 1, n + 2)."""
        left = state[0]
        plan = self._own.encode(np.stack([left > IDLE, np.maximum(left, 0)], axis=1).astype(np.float64))
        return np.concatenate([seen.observation, plan], axis=1)[:, np.newaxis]

    def masks(self, seen: Seen, state: State) -> BoolArray:
        """Any delay, and whatever is possible at some time, (B, 1, k); only the neutral choice while a plan is on."""
        free = state[0] == IDLE
        legal = np.ones((len(seen), sum(self._choices)), np.bool_)
        ends = np.cumsum(self._choices)
        legal[:, ends[0] : ends[1]] = self._choosable(seen)
        if "jam_left_s" in seen:
            legal[:, ends[1] :] = (seen["jam_left_s"] > 0)[:, np.newaxis]
        legal &= free[:, np.newaxis]
        legal[:, ends - self._choices] = True
        return legal[:, np.newaxis]

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Where nothing is planned, (B, 1)."""
        idle: BoolArray = state[0] == IDLE
        return idle[:, np.newaxis]

    def due(self, seen: Seen, state: State) -> BoolArray:
        """Where nothing is planned, and something is left to disband, (B,)."""
        free: BoolArray = (state[0] == IDLE) & self._possible(seen)[:, 1:].any(axis=1)
        return free

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The attacker's action (B,): what is planned, when it is due and legal, else 0."""
        left, target, jam = state
        free = left == IDLE
        chosen: IntArray = actions[:, 0].astype(np.int64)
        left = np.where(free, self.delays_s[chosen[:, 0]], left)
        target = np.where(free, self._platoon(seen, chosen[:, 1]), target)
        jam = np.where(free & (target > 0), chosen[:, 2], jam) if chosen.shape[1] > 2 else jam
        rows, due = np.arange(len(seen)), left <= 0
        link = np.where(target > 1, self._platoons + target - 1, 0)  # of the platoon behind the target
        legal = self._legal(seen)
        strikes = (target > 0) & legal[rows, target]
        struck = (target > 0) & ~self._possible(seen)[rows, target]  # or it never will be legal
        can_jam = (link > 0) & legal[rows, np.minimum(link, legal.shape[1] - 1)]
        jams = due & np.where(jam == BEFORE, strikes & can_jam, (jam == AFTER) & struck & can_jam)
        hits = due & strikes & ~jams
        action = np.where(jams, link, np.where(hits, target, 0))
        waits = hits & (jam == AFTER)  # with the jam
        over = due & ((target == 0) | (hits & ~waits) | struck)
        runs = self._runs(legal, target)
        left = np.where(over, IDLE, np.maximum(left - runs, 0))
        jam = np.where(over | jams, NO_JAM, jam)
        return action, (left, target, jam)

    def _choosable(self, seen: Seen) -> BoolArray:
        """Which choices (B, N + 1) of whom have an effect now or later."""
        return self._possible(seen)

    def _platoon(self, seen: Seen, chosen: IntArray) -> IntArray:
        """The paper's platoon (B,) that a choice (B,) means; 0 for none."""
        return chosen

    def _runs(self, legal: BoolArray, target: IntArray) -> BoolArray:
        """Where the delay of a plan passes now, (B,), given what is legal (B, k) and whom the plan disbands."""
        return np.ones(len(target), np.bool_)

    def _legal(self, seen: Seen) -> BoolArray:
        """What is legal now, (B, k); what is possible, where the masks are not seen."""
        if seen.masks is not None:
            return seen.masks
        jams = np.ones((len(seen), self._platoons - 1), np.bool_)
        return np.concatenate([self._possible(seen), jams], axis=1)

    def _possible(self, seen: Seen) -> BoolArray:
        """Waiting and the platoons, (B, N + 1), that may be disbanded now or later."""
        platoons = seen["disbanded"].shape[1]
        present = seen["present"] > HALF if "present" in seen else np.ones((len(seen), platoons), np.bool_)
        attack = present & (seen["disbanded"] < HALF) & (seen["budget_left"] > HALF)[:, np.newaxis]
        return np.concatenate([np.ones((len(seen), 1), np.bool_), attack], axis=1)


class FromFront(Timed):
    """`Timed` for learners that take no masks: whom they choose, it can always be disbanded.

    What: 0 to look again by then, or k for the k-th platoon, counted from the front of the road, of those that are
    still intact; beyond the last of them it is that one. When: so long after it is legal, which a delay of `timed`
    may be over before.
    """

    delays_s = np.array([0, 20, 40, 60])  # chosen: a wave needs 20 s to the rear

    def _choosable(self, seen: Seen) -> BoolArray:
        left = self._possible(seen)[:, 1:].sum(axis=1, keepdims=True)
        choosable: BoolArray = np.arange(self._platoons + 1) <= left
        return choosable

    def _platoon(self, seen: Seen, chosen: IntArray) -> IntArray:
        intact = self._possible(seen)[:, :0:-1]  # (B, N), from the front
        place = np.cumsum(intact, axis=1)
        wanted = np.minimum(chosen, place[:, -1])
        found = np.argmax(intact & (place == wanted[:, np.newaxis]), axis=1)
        return np.where(wanted > 0, self._platoons - found, 0)

    def _runs(self, legal: BoolArray, target: IntArray) -> BoolArray:
        runs: BoolArray = (target == 0) | legal[:, 1 : self._platoons + 1].any(axis=1)
        return runs
