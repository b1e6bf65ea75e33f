"""Defenders that are told what a defender has to find out: who lies, or what the temperatures are."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.hypotheses import FilterChoices
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec, told_of
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, State
from cps_envs.hvac.sensors import sensor_sets


class Informed(AnalyticPolicy):
    """Knows which sensors are compromised, and believes the Kalman filter of all others.

    Raises:
        ConfigurationError: a configuration without Kalman filters.
    """

    privileged = frozenset({"truth"})

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self._filters = FilterChoices(spec.config)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """The filter (B,) of each episode."""
        intact = np.stack([~known["truth"]["compromised"] for known in knowledge])
        return (self._filters.index_of(intact),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Choices (B,)."""
        return self._filters.choices(state[0], seen), state


class Truth(AnalyticPolicy):
    """Knows the true temperatures, and picks the estimate nearest to them.

    It is no bound: a choice also steers the heating, and one that looks ahead can pay less. Nearest is by the sum of
    squared differences over the zones. Before the window is full it takes the model's choice, the
    recursive least squares, as the others do.
    """

    privileged = frozenset({"truth"})

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        self._model = len(sensor_sets(spec.config)) + 1

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """What tells the truth of each episode (B,)."""
        return (told_of(knowledge),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Choices (B,)."""
        true = np.stack([told["truth"]["temperature"] for told in state[0]])
        error = ((seen["estimate"] - true[:, np.newaxis]) ** 2).sum(axis=2)
        return np.where(seen["ready"] > 0.5, error.argmin(axis=1), self._model), state
