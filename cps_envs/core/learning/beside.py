"""The same episodes beside a learner's, played with the neutral action: what luck alone would have paid."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np

from cps_envs.core.game.problem import Problem
from cps_envs.core.learning.outside import Outside
from cps_envs.core.learning.wired_player import rows_of
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.policies.state import put
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, Role, State, other


class Beside:
    """B episodes that begin as the learner's do, with the same draws, in which its role plays the neutral action."""

    def __init__(
        self, problem: Problem, config: object, num_envs: int, role: Role, opponent: PolicyReference, adapter: str
    ) -> None:
        """`adapter` is the one whose agents' neutral action is played."""
        self._match = problem.match(config, num_envs, {other(role): opponent})
        self._game = self._match.game
        self._outside = Outside(self._game, role, adapter)
        self._interval = self._game.decision_interval[role]
        neutral = self._outside.adapter.neutral_action
        self._actions: Array = np.full((num_envs, len(self._outside.agents), *neutral.shape), neutral)
        self._state: State = self._outside.adapter.begin(num_envs)

    def reset(self, envs: BoolArray, generators: Generators, drawn: Any = None) -> None:
        """Start the marked episodes (B,) as `Match.reset` with these arguments will; generators stay as they are."""
        self._match.reset(envs, deepcopy(list(generators)), drawn)
        rows = envs.nonzero()[0]
        fresh = put(tuple(map(np.copy, self._state)), rows, self._outside.adapter.begin(len(rows)), len(envs))
        self._state = self._state if fresh is None else fresh

    def step(self, envs: BoolArray, times: int) -> FloatArray:
        """So many decisions of the role in the marked episodes (B,), or to their ends; the agents' rewards (B, A)."""
        rewards: FloatArray = np.zeros(self._actions.shape[:2])
        for _ in range(times):
            live = envs & ~self._game.terminated & (self._game.elapsed < self._game.horizon)
            if not live.any():
                break
            action, state = self._outside.act(self._outside.seen(), self._state, self._actions)
            self._state = tuple(rows_of(new, old, live) for new, old in zip(state, self._state, strict=True))
            payoff = self._match.step({self._outside.role: action}, live, self._interval)
            rewards += np.where(live[:, np.newaxis], self._outside.rewards(payoff), 0.0)
        return rewards
