"""The decentralised defence: one agent per intact vehicle, each with its own sensors and its own law or command."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces

from cps_envs.core.team import Team
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.rogue.actions import mode_space
from cps_envs.rogue.fields import vehicle_fields
from cps_envs.rogue.observation import observe_vehicles

if TYPE_CHECKING:
    from cps_envs.rogue.game import RogueGame


class VehicleTeam(Team):
    """Agents `intact_1` (rear) to `intact_{n-1}` (leader), without the seized vehicle; all share minus the payoff."""

    def __init__(self, game: RogueGame) -> None:
        self._game = game
        self.agents = tuple(f"intact_{k + 1}" for k in range(game.config.num_intact))
        self.fields = vehicle_fields(game.config)
        self.action_space = mode_space(1) if game.modes else spaces.Box(-1.0, 1.0, (1,), np.float32)

    def observe(self) -> Observation:
        """Own rows (B, n - 1, size), see `fields.vehicle_fields`."""
        game = self._game
        values = np.empty((game.num_envs, len(self.agents), self.fields.size))
        observe_vehicles(game.state, game.rules, game.modes, values)
        return self.fields.encode(values.reshape(-1, self.fields.size)).reshape(values.shape)

    def join(self, actions: Array) -> Array:
        """The defender's action (B, 2 (n - 1)) from (B, n - 1, 2), or (B, n - 1) from (B, n - 1, 1)."""
        return actions.reshape(len(actions), -1)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, n - 1) of the last step."""
        return np.repeat(-payoff[:, np.newaxis], len(self.agents), axis=1)
