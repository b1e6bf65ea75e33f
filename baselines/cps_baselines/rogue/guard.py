"""Extension beyond the paper: a defender that gives way to the vehicle which the monitor suspects, by accelerations."""

from __future__ import annotations

import numpy as np

from cps_baselines.family import as_records
from cps_baselines.rogue.monitor import NOBODY, Monitor
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray, Generators, IntArray, Knowledge, State
from cps_envs.rogue.giving_way import GivingWay, Ways


class Guard(AnalyticPolicy):
    """`monitor` until it suspects somebody, then `escort` of the suspect, as long as it is one.

    `numbers` are those of `Escort`; `threshold_mps` and `slack_mps2` are those of the monitor: at smaller ones it finds
    the attacker sooner and somebody honest more often, which costs little where the others only give way.

    Raises:
        ConfigurationError: what `Escort` and `Monitor` refuse.
    """

    searched_numbers = len(Ways._fields)

    def __init__(self, spec: RoleSpec, numbers: FloatArray, threshold_mps: float, slack_mps2: float) -> None:
        super().__init__(spec)
        self._giving_way = GivingWay(spec, as_records(Ways, numbers))
        self._monitor = Monitor(spec, threshold_mps=threshold_mps, slack_mps2=slack_mps2)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What the monitor remembers, see there, and the gaps and rates (B, n - 1) as they are filtered."""
        held = self._monitor.begin(generators, knowledge)
        return (*held, self._giving_way.unfiltered(len(generators)), self._giving_way.unfiltered(len(generators)))

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """The orders (B, 2 n) of all vehicles."""
        watched, held = self._monitor.act(seen, state[:4])
        suspects = held[1]
        given, gaps, rates = self._giving_way.orders(seen, suspects, *state[4:])
        orders = np.where(suspects[:, np.newaxis] == NOBODY, watched, given)
        return orders, self.told(orders, (*held, gaps, rates))

    def told(self, orders: IntArray, state: State) -> State:
        """See `Monitor`."""
        return self._monitor.told(orders, state)

    def beliefs(self, state: State) -> dict[str, Array]:
        """Those of the monitor."""
        return self._monitor.beliefs(state)
