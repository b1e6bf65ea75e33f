"""The paper's attacker: Algorithm 2 on what it observes, injection by injection."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from cps_baselines.fdi.branch_and_bound import CORRECTED, SearchTables, fill_sequences, make_search
from cps_baselines.fdi.injection import InjectionPolicy, View, view_of
from cps_envs.core.policies.policy import RoleSpec, plays_in
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, Generators, IntArray, Knowledge, State


@plays_in("paper")
class BranchAndBound(InjectionPolicy):
    """Destabilises the attacked vehicle with the smallest injections that satisfy (3.39), or (3.40) and (3.41).

    `steps_ahead` is N_h: sequences of N_h + 1 injections are found and applied as a whole. `width` keeps only so many
    candidates per sensor and step, a heuristic; 0 is the exact search. Several attacked vehicles are each attacked as
    if alone, which goes beyond the paper. The algorithm knows no target, and no limits of acceleration: `legal` takes
    the nearest legal levels instead of its own. `infeasible_calls` counts searches without a sequence, after which
    nothing is injected.
    """

    exact = True

    def __init__(
        self,
        spec: RoleSpec,
        *,
        steps_ahead: int = 0,
        width: int = 0,
        legal: bool = True,
        gap_sign: float = CORRECTED,
    ) -> None:
        super().__init__(spec, legal=legal)
        self.steps_ahead, self.infeasible_calls = steps_ahead, 0
        self._options: dict[str, Any] = {"steps_ahead": steps_ahead, "width": width, "gap_sign": gap_sign}
        n, places = self.config.num_vehicles, {sensor: slot for slot, sensor in enumerate(self.form.sensors.tolist())}
        slots = [(i, places.get(i - 1, -1), places.get(n + i - 1, -1)) for i in range(1, n + 1)]
        self._vehicles = [own for own in slots if max(own[1:]) >= 0]  # and their slots for range and range-rate
        self._searches: dict[tuple[int, str], SearchTables] = {}
        self._search(1, "x")  # refuses impossible options

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Sequences (B, N_h + 1, S) that are all used up."""
        envs = len(generators)
        sequences = np.zeros((envs, self.steps_ahead + 1, len(self.form.sensors)), np.int64)
        return sequences, np.full(envs, self.steps_ahead + 1)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The next injections of the sequences; new sequences where they are used up."""
        view = view_of(self.form, seen)
        sequences, used = state[0].copy(), state[1].copy()
        due = used > self.steps_ahead
        sequences[due], used[due] = 0, 0
        for envs, vehicle, kind, slots in self._attacks(view, due):
            search = self._search(vehicle, kind)
            self.infeasible_calls += fill_sequences(search, view.error, envs, slots, sequences)
        actions = self.say(view, sequences[np.arange(len(used)), used], seen.masks)
        return actions, (sequences, used + 1)

    def _search(self, vehicle: int, kind: str) -> SearchTables:
        key = vehicle, kind  # quicker than hashing a configuration
        if key not in self._searches:
            self._searches[key] = make_search(self.config, vehicle, kind, **self._options)
        return self._searches[key]

    def _attacks(self, view: View, due: BoolArray) -> Iterator[tuple[BoolArray, int, str, IntArray]]:
        """The episodes (B,) that need a new sequence against sensors of a vehicle, of which kind, and their slots."""
        wanted = view.attacked & due[:, np.newaxis]
        some: BoolArray = np.any(wanted, axis=0)
        for vehicle, ranges, rates in self._vehicles:
            if ranges < 0 or rates < 0 or not (some[ranges] and some[rates]):
                for kind, slot in (("x", ranges), ("v", rates)):
                    if slot >= 0 and some[slot]:
                        yield wanted[:, slot], vehicle, kind, np.array([slot])
                continue
            both = wanted[:, ranges] & wanted[:, rates]
            yield wanted[:, ranges] & ~both, vehicle, "x", np.array([ranges])
            yield wanted[:, rates] & ~both, vehicle, "v", np.array([rates])
            yield both, vehicle, "xv", np.array([ranges, rates])
