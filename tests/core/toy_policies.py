"""Players of the toy problem: without state, with a state of its own, and with draws at each episode's start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cps_envs.core.policies.policy import AnalyticPolicy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, State


class Chase(AnalyticPolicy):
    """The guard runs straight at the intruder."""

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        return np.clip(seen["rival"] - seen["own"], -1, 1).astype(np.float32), state


class Approach(AnalyticPolicy):
    """The intruder moves along its longer axis, and pauses at every second decision: a policy with state."""

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        own, count = seen["own"], np.zeros(len(seen), np.int64)
        if state is not None:
            count = np.where(seen.start, 0, state[0])
        axis = np.argmax(np.abs(own), axis=1)
        backwards = np.take_along_axis(own, axis[:, np.newaxis], axis=1)[:, 0] > 0
        return np.where(count % 2 == 0, 1 + 2 * axis + backwards, 0), (count + 1,)


class Wander(AnalyticPolicy):
    """The intruder keeps a direction that it draws when the episode starts, and a generator for pauses."""

    def begin(self, generators: Sequence[np.random.Generator], knowledge: Sequence[Mapping[str, Any]]) -> State:
        draws = np.array([generator.integers(1, 5) for generator in generators])
        own = np.empty(len(generators), object)
        own[:] = list(generators)
        return draws, own

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        assert state is not None
        moving = np.array([generator.random() < 0.8 for generator in state[1]])
        return np.where(moving, state[0], 0), state
