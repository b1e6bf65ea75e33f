"""The decentralised defence: one agent for each vehicle that gets orders, with its own sensors and controller."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.team import Team
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.rogue.actions import mode_space
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.fields import vehicle_fields
from cps_envs.rogue.observation import observe_vehicles
from cps_envs.rogue.state import State


class VehicleTeam(Team):
    """Agents `intact_1` (rear) to `intact_{n-1}` (leader), without the seized vehicle; all share minus the payoff.

    With `orders="all"` they are `vehicle_1` to `vehicle_n`, with the seized one and those that an episode lacks.

    They look at the state, the drawn quantities and the rules of a game.
    """

    def __init__(self, config: RogueConfig, state: State, drawn: Array, rules: Array) -> None:
        self._seen = (state, drawn, rules)
        self._num_envs = len(drawn)
        name = "vehicle" if config.hidden else "intact"
        self.agents = tuple(f"{name}_{k + 1}" for k in range(config.num_orders))
        self.fields = vehicle_fields(config)
        modes = config.defense_action == "mode"
        self.action_space = mode_space(1) if modes else spaces.Box(-1.0, 1.0, (1,), np.float32)

    def observe(self) -> Observation:
        """Own rows (B, k, size), see `fields.vehicle_fields`."""
        encoded = np.empty((self._num_envs, len(self.agents), self.fields.size), np.float32)
        observe_vehicles(*self._seen, self.fields.offsets, self.fields.scale, encoded)
        return encoded

    def join(self, actions: Array) -> Array:
        """The defender's action (B, 2 k) from (B, k, 2), or (B, k) from (B, k, 1)."""
        return actions.reshape(len(actions), -1)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, k) of the last step."""
        return np.repeat(-payoff[:, np.newaxis], len(self.agents), axis=1)
