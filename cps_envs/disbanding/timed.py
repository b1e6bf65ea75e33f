"""What an attacker learns through that says when to strike next, instead of deciding anew each second."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.adapter import Adapter
from cps_envs.core.fields import Field, Fields
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, IntArray, Observation

DELAYS_S = np.array([0, 1, 2, 3, 5, 8, 12, 16, 20, 25, 30, 40, 50, 60, 80, 100])  # chosen
IDLE = -1
HALF = 0.5  # of an entry that is 0 or 1


class Timed(Adapter):
    """One agent with two choices: in how many seconds, and then what, of the attacker's own actions.

    What it has chosen is done at that time, or as soon after as it is legal, and until then it can choose nothing else.
    An attack that comes once in a minute would otherwise be improbable in every single second, and a policy that
    always takes its most probable action would never attack. Choosing 0, to wait, means to look again by then.
    """

    masked = True

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self.agents = (spec.role,)
        self._longest_s = float(DELAYS_S[-1])
        self.fields = Fields(
            *spec.fields,
            Field("plans", "-", 0, 1, (), "something is chosen and not done yet"),
            Field("due_in_s", "s", 0, self._longest_s, (), "until it is done"),
        )
        self._own = Fields(*list(self.fields)[-2:])
        self._targets = int(spec.config.num_attacks)
        self.action_space = spaces.MultiDiscrete([len(DELAYS_S), self._targets])
        self.neutral_action = np.zeros(2, np.int64)

    def begin(self, num_envs: int) -> State:
        """Seconds until the plan is due (B,), below 0 without one, and what is planned (B,)."""
        return np.full(num_envs, IDLE), np.zeros(num_envs, np.int64)

    def observe(self, seen: Seen, state: State) -> Observation:
        """The attacker's observation and its plan, (B, 1, n + 2)."""
        left, _ = state
        plan = self._own.encode(np.stack([left > IDLE, np.maximum(left, 0)], axis=1).astype(np.float64))
        return np.concatenate([seen.observation, plan], axis=1)[:, np.newaxis]

    def masks(self, seen: Seen, state: State) -> BoolArray:
        """Any delay, and whatever is possible at some time, (B, 1, k); only the neutral choice while a plan is on."""
        free = state[0] == IDLE
        legal = np.ones((len(seen), len(DELAYS_S) + self._targets), np.bool_)
        legal[:, len(DELAYS_S) :] = self._possible(seen)
        legal &= free[:, np.newaxis]
        legal[:, [0, len(DELAYS_S)]] = True
        return legal[:, np.newaxis]

    def active(self, seen: Seen, state: State) -> BoolArray:
        """Where nothing is planned, (B, 1)."""
        idle: BoolArray = state[0] == IDLE
        return idle[:, np.newaxis]

    def act(self, seen: Seen, state: State, actions: Array) -> tuple[Array, State]:
        """The attacker's action (B,): what is planned, when it is due and legal, else 0."""
        left, target = state
        free = left == IDLE
        chosen: IntArray = actions[:, 0].astype(np.int64)
        left = np.where(free, DELAYS_S[chosen[:, 0]], left)
        target = np.where(free, chosen[:, 1], target)
        rows = np.arange(len(seen))
        able = self._possible(seen)[rows, target]
        legal = able if seen.masks is None else seen.masks[rows, target]
        done = (left <= 0) & (legal | (target == 0))
        action = np.where(done, target, 0)
        left = np.where(done | ~able, IDLE, np.maximum(left - 1, 0))
        return action, (left, target)

    def _possible(self, seen: Seen) -> BoolArray:
        """The attacker's actions (B, k) that are legal now or may be later: waiting always is."""
        platoons = seen["disbanded"].shape[1]
        present = seen["present"] > HALF if "present" in seen else np.ones((len(seen), platoons), np.bool_)
        possible = np.zeros((len(seen), self._targets), np.bool_)
        possible[:, 0] = True
        attack = present & (seen["disbanded"] < HALF) & (seen["budget_left"] > HALF)[:, np.newaxis]
        possible[:, 1 : platoons + 1] = attack
        if self._targets > platoons + 1:
            link = present[:, 1:] & (seen["jammed"] < HALF) & (seen["jam_left_s"] > 0)[:, np.newaxis]
            possible[:, platoons + 1 :] = link
        return possible
