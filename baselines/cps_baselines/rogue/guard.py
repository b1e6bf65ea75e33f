"""Extension beyond the paper: a defender that gives way to the vehicle which the monitor suspects, by accelerations."""

from __future__ import annotations

import numpy as np

from cps_baselines.rogue.escort import Escort
from cps_baselines.rogue.monitor import NOBODY, Monitor
from cps_envs.core.policy import AnalyticPolicy, Generators, Knowledge, RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, FloatArray


class Guard(AnalyticPolicy):
    """`monitor` until it suspects somebody, then `escort` of the suspect, as long as it is one.

    `numbers` are those of `Escort`, `threshold_mps` is that of the monitor: at the smaller one somebody honest is
    suspected more often, which costs little where the others only give way.

    Raises:
        ConfigurationError: what `Escort` and `Monitor` refuse.
    """

    def __init__(self, spec: RoleSpec, numbers: FloatArray, threshold_mps: float = 4.0) -> None:
        super().__init__(spec)
        self._escort, self._monitor = Escort(spec, numbers), Monitor(spec, threshold_mps=threshold_mps)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What the monitor remembers, see there, and the gaps and rates (B, n - 1) as they are filtered."""
        held = self._monitor.begin(generators, knowledge)
        assert held is not None
        return (*held, self._escort.unfiltered(len(generators)), self._escort.unfiltered(len(generators)))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The orders (B, 2 n) of all vehicles."""
        watched, held = self._monitor.act(seen, state[:3])
        assert held is not None
        suspects = held[1]
        orders, gaps, rates = self._escort.give_way(seen, suspects, *state[3:])
        return np.where(suspects[:, np.newaxis] == NOBODY, watched, orders), (*held, gaps, rates)

    def beliefs(self, state: State) -> dict[str, Array]:
        """Those of the monitor."""
        return self._monitor.beliefs(state)
