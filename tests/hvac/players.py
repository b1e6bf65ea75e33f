"""Small policies that the tests of the HVAC problem play with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cps_envs.core.policies.policy import AnalyticPolicy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, State
from cps_envs.hvac.attack import absolute_action


class Seeded(AnalyticPolicy):
    """Base of policies that draw: the state is one generator's key and a counter per environment."""

    def begin(self, generators: Any, knowledge: Sequence[Mapping[str, Any]]) -> State:
        return (np.array([generator.integers(2**62) for generator in generators]), np.zeros(len(generators), np.int64))

    def draw(self, state: Any, options: Any) -> Any:
        """One of the marked options (B, k) for each environment, and the next state."""
        keys, count = state
        chosen = [
            np.random.default_rng([key, n]).choice(np.flatnonzero(row))
            for key, n, row in zip(keys.tolist(), count.tolist(), options, strict=True)
        ]
        return np.array(chosen), (keys, count + 1)


class RandomChoice(Seeded):
    """Any legal choice."""

    masked = True

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        return self.draw(state, seen.masks)


class MovingTarget(Seeded):
    """A set at random among those that the field `mark` marks; the least mean residual where there is none."""

    def __init__(self, spec: Any, mark: str = "passes") -> None:
        super().__init__(spec)
        self._mark = mark

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        marked = seen[self._mark] > 0.5
        least = seen["mean_residual"] == seen["mean_residual"].min(axis=1, keepdims=True)
        chosen, state = self.draw(state, np.where(marked.any(axis=1, keepdims=True), marked, least))
        return np.where(seen["ready"] > 0.5, chosen + 1, self.spec.action_space.n - 1), state


class Always(AnalyticPolicy):
    """The same choice at every step."""

    def __init__(self, spec: Any, choice: int = 0) -> None:
        super().__init__(spec)
        self._choice = choice

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        return np.full(len(seen), self._choice), state


class Constant(AnalyticPolicy):
    """Compromised sensors show `reading_c`."""

    def __init__(self, spec: Any, reading_c: float = 22.0) -> None:
        super().__init__(spec)
        self._reading_c = reading_c

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        config = self.spec.config
        return absolute_action(config, np.full((len(seen), config.num_sensors), self._reading_c)), state
