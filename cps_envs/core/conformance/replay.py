"""A policy that plays back recorded actions, one per decision."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cps_envs.core.types import Array, BoolArray, Generators, Knowledge, State


class Scripted:
    """Plays `actions` (T, ...) from the start of each episode, whatever it observes; the last one holds."""

    def __init__(self, actions: Sequence[Array]) -> None:
        self._actions = np.stack(actions)

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """Count each environment's decisions from zero."""
        return (np.zeros(len(generators), np.int64),)

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """The next recorded action of each environment."""
        assert state is not None  # begun
        decision = np.minimum(state[0], len(self._actions) - 1)
        return self._actions[decision], (state[0] + 1,)
