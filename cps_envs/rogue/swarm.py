"""The decentralised defence: one agent per intact vehicle, each with its own sensors and its own controller."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.team import Team
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.rogue.actions import mode_space
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.observation import observe_vehicles, vehicle_fields
from cps_envs.rogue.state import State


class VehicleTeam(Team):
    """Agents `intact_1` (rear) to `intact_{n-1}` (leader), without the seized vehicle; all share minus the payoff.

    They look at the state, the drawn quantities and the rules of a game.
    """

    def __init__(self, config: RogueConfig, state: State, drawn: Array, rules: Array) -> None:
        self._seen = (state, drawn, rules)
        self._num_envs = len(drawn)
        self.agents = tuple(f"intact_{k + 1}" for k in range(config.num_intact))
        self.fields = vehicle_fields(config)
        modes = config.defense_action == "mode"
        self.action_space = mode_space(1) if modes else spaces.Box(-1.0, 1.0, (1,), np.float32)

    def observe(self) -> Observation:
        """Own rows (B, n - 1, size), see `observation.vehicle_fields`."""
        encoded = np.empty((self._num_envs, len(self.agents), self.fields.size), np.float32)
        observe_vehicles(*self._seen, self.fields.offsets, self.fields.scale, encoded)
        return encoded

    def join(self, actions: Array) -> Array:
        """The defender's action (B, 2 (n - 1)) from (B, n - 1, 2), or (B, n - 1) from (B, n - 1, 1)."""
        return actions.reshape(len(actions), -1)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, n - 1) of the last step."""
        return np.repeat(-payoff[:, np.newaxis], len(self.agents), axis=1)
