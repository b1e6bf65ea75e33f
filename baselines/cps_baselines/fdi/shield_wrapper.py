"""A shield around the attacker's environment, for learners."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from cps_baselines.fdi.shields import make_shield
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import IntArray, Observation
from cps_envs.fdi.game import FdiGame


class ShieldedInjection(gymnasium.Wrapper[Observation, Any, Observation, Any]):
    """`FdiAttackEnv` whose actions pass a shield, "lp" or "sound", that knows the true state.

    `info["shielded"]` is 1.0 where something else was injected than asked for.

    Raises:
        ConfigurationError: not an attacker's environment of this problem, no such shield, or clipped limits.
    """

    def __init__(self, env: gymnasium.Env[Observation, Any], kind: str = "lp", time_limit_s: float = 1.0) -> None:
        super().__init__(env)
        unwrapped: Any = env.unwrapped
        game = getattr(unwrapped, "game", None)
        if not isinstance(game, FdiGame) or unwrapped.role != "attacker":
            raise ConfigurationError("ShieldedInjection wraps the environment FdiAttack")
        self.game: FdiGame = game
        self.shield = make_shield(kind, game.config, time_limit_s)
        self._kept = self._nothing()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode."""
        self._kept = self._nothing()
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, {**info, "shielded": 0.0}

    def step(self, action: Any) -> tuple[Observation, Any, bool, bool, dict[str, Any]]:
        """Advance by one decision."""
        game, form = self.game, self.shield.form
        task = game.tasks[game.state.task[0]]
        attacked = task.sensors.flags(game.config.num_vehicles)[form.sensors][np.newaxis]
        error = game.state.error[0].copy()
        wish = form.to_levels(error[np.newaxis], attacked, np.asarray(action)[np.newaxis])
        levels, self._kept = self.shield.allow(task, error, int(game.state.step[0]), wish[0], self._kept)
        actions, injected = form.to_actions(error[np.newaxis], attacked, levels[np.newaxis])
        observation, reward, terminated, truncated, info = self.env.step(actions[0])
        shielded = float(not np.array_equal(injected, wish))
        return observation, reward, terminated, truncated, {**info, "shielded": shielded}

    def _nothing(self) -> IntArray:
        return np.zeros((0, len(self.shield.form.sensors)), np.int64)
