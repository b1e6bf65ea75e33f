"""Attacks timed from what the attacker sees: platoons one after the other, and a jam around one of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, IntArray, Knowledge, State

HALF = 0.5  # of an entry that is 0 or 1
TOLERANCE_S = 0.01  # of an observed time
NEVER_S = 1e9


class Timed(AnalyticPolicy):
    """Disbands platoons `first`, `second` and `third`, counted from the front (1), while the budget lasts.

    The first attack comes `delay_s` after attacks become legal, each further one `pause_s` after the last, or at
    `by_s` of the episode if that is earlier, but never before it is legal. `jam` is the platoon, counted from the
    front, behind which the radio is blocked (0: no jam), `jam_s` after attack number `jam_at`; below 0: as long before
    it, which puts that attack off. All numbers may be fractions: they are rounded.

    Raises:
        ConfigurationError: two attacks on the same platoon, or a platoon that never exists.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        first: float = 1,
        second: float = 2,
        third: float = 3,
        delay_s: float = 0.0,
        pause_s: float = 60.0,
        by_s: float = NEVER_S,
        jam: float = 0,
        jam_at: float = 1,
        jam_s: float = -1.0,
    ) -> None:
        super().__init__(spec)
        self.order = distinct([first, second, third], spec.config.max_platoons)
        if spec.config.can_jam and round(jam) >= spec.config.max_platoons:
            raise ConfigurationError(f"jam = {jam}: no vehicle drives behind the rear platoon")
        self.delay_s, self.pause_s, self.by_s = round(delay_s), float(round(pause_s)), float(by_s)
        self.jam, self.jam_at, self.jam_s = round(jam) if spec.config.can_jam else 0, round(jam_at), round(jam_s)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """For how many decisions the next attack has been legal, and since when a jam has been on, (B,) each."""
        return np.zeros(len(generators), np.int64), np.zeros(len(generators), np.int64)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Platoon to disband, N + the platoon ahead of which to jam, or 0, for each episode (B,)."""
        return self.attack(seen, state, np.full(len(seen), self.pause_s))

    def attack(self, seen: Seen, state: State, pause_s: FloatArray) -> tuple[Array, tuple[Array, ...]]:
        """`act` with a pause for each episode, (B,) s."""
        ready, jammed = state
        disbanded = seen["disbanded"] > HALF
        attacks = disbanded.sum(axis=1)
        since_s = np.where(disbanded, seen["since_disbanding_s"], np.inf).min(axis=1)
        able = (seen["budget_left"] > HALF) & (attacks < len(self.order)) & (seen["time_s"] > 1.0 - TOLERANCE_S)
        if "opens_in_s" in seen:
            able &= seen["opens_in_s"] < TOLERANCE_S
        later = (since_s >= pause_s - TOLERANCE_S) | (seen["time_s"] >= self.by_s)
        wanted, jams = able & np.where(attacks == 0, ready >= self.delay_s, later), np.zeros(len(seen), np.bool_)
        if self.jam > 0:
            wanted, jams = self._around(wanted, attacks, since_s, seen["jam_left_s"] > TOLERANCE_S, jammed)
        present = count_platoons(seen, disbanded)
        target = present + 1 - np.take(self.order, np.minimum(attacks, len(self.order) - 1))
        link = disbanded.shape[1] + present - self.jam
        actions = np.where(jams & (present > self.jam), link, np.where(wanted, np.maximum(target, 0), 0))
        return actions, (ready + (able & (attacks == 0)), jammed + (jams | (jammed > 0)))

    def _around(
        self, wanted: BoolArray, attacks: IntArray, since_s: FloatArray, left: BoolArray, jammed: IntArray
    ) -> tuple[BoolArray, BoolArray]:
        """Which attacks are made and which jams begin, of the attacks `wanted`."""
        if self.jam_s >= 0:
            late = (attacks >= self.jam_at) & (since_s >= self.jam_s - TOLERANCE_S)
            return wanted, left & (jammed == 0) & ~wanted & late
        mine = attacks + 1 == self.jam_at
        begins = wanted & mine & left & (jammed == 0)
        return wanted & ~(mine & (begins | ((jammed > 0) & (jammed < -self.jam_s)))), begins


def distinct(places: Sequence[float], platoons: int) -> IntArray:
    """Whole places in [1, platoons]; one that is taken moves back to the next free one, as far as there are any.

    Raises:
        ConfigurationError: a place outside.
    """
    taken: list[int] = []
    for place in places:
        if not 1 <= round(place) <= platoons:
            raise ConfigurationError(f"platoon {place} from the front does not exist: there are {platoons}")
        free = [k for k in (*range(round(place), platoons + 1), *range(1, platoons + 1)) if k not in taken]
        taken += free[:1]
    return np.array(taken)


def count_platoons(seen: Seen, disbanded: BoolArray) -> IntArray:
    """How many platoons there are in each episode, (B,)."""
    if "present" in seen:
        present: IntArray = np.sum(seen["present"] > HALF, axis=1)
        return present
    return np.full(len(seen), disbanded.shape[1])
