"""The paper's attacker: Algorithm 2 on what it observes, injection by injection."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from baselines.fdi.action_form import Pick
from baselines.fdi.branch_and_bound import CORRECTED, Search, find_injections, make_search
from baselines.fdi.injection import InjectionPolicy, View, wished
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.types import BoolArray, IntArray


class BranchAndBound(InjectionPolicy):
    """Destabilises the attacked vehicle with the least injections that satisfy (3.39), or (3.40) and (3.41).

    `steps_ahead` is N_h: sequences of N_h + 1 injections are found and applied as a whole. `width` keeps only so many
    candidates per sensor and step, a heuristic; 0 is the exact search. Several attacked vehicles are each attacked as
    if alone, which goes beyond the paper. The algorithm knows no target, and no limits of acceleration: `legal` takes
    the nearest legal levels instead of its own. `infeasible_calls` counts searches without a sequence, after which
    nothing is injected.
    """

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
        self._search(1, "x")  # refuses impossible options

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        """Sequences (B, N_h + 1, S) that are all used up."""
        envs = len(generators)
        sequences = np.zeros((envs, self.steps_ahead + 1, len(self.form.sensors)), np.int64)
        return sequences, np.full(envs, self.steps_ahead + 1)

    def choose(self, view: View, state: State) -> tuple[Pick, State]:
        """The next injections of the sequences; new sequences where they are used up."""
        assert state is not None
        sequences, used = state[0].copy(), state[1].copy()
        due = used > self.steps_ahead
        sequences[due], used[due] = 0, 0
        for envs, vehicle, kind in self._attacks(view, due):
            found = find_injections(self._search(vehicle, kind), view.error[envs])
            self.infeasible_calls += int(np.sum(~found.found))
            slots = np.flatnonzero(np.isin(self.form.sensors, self._search(vehicle, kind).readings))
            sequences[envs[:, np.newaxis], :, slots] = found.levels.transpose(0, 2, 1)
        return wished(sequences[np.arange(len(used)), used]), (sequences, used + 1)

    def _search(self, vehicle: int, kind: str) -> Search:
        return make_search(self.config, vehicle, kind, **self._options)

    def _attacks(self, view: View, due: BoolArray) -> Iterator[tuple[IntArray, int, str]]:
        """The episodes that attack a vehicle with a kind of sensors and need a new sequence."""
        n = self.config.num_vehicles
        attacked = np.zeros((len(due), 2 * n), np.bool_)
        attacked[:, self.form.sensors] = view.attacked & due[:, np.newaxis]
        for vehicle in range(1, n + 1):
            ranges, rates = attacked[:, vehicle - 1], attacked[:, n + vehicle - 1]
            for kind, chosen in (("x", ranges & ~rates), ("v", rates & ~ranges), ("xv", ranges & rates)):
                if chosen.any():
                    yield np.flatnonzero(chosen), vehicle, kind
