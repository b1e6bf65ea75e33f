"""The decentralised defence: one agent per vehicle, each with its own row of sensors and its own correction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.team import Team
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.disbanding.fields import vehicle_fields
from cps_envs.disbanding.observation import observe_vehicles

if TYPE_CHECKING:
    from cps_envs.disbanding.game import DisbandingGame


class VehicleTeam(Team):
    """Agents `vehicle_0` (front) to `vehicle_{M-1}`; the set is constant, disbanded vehicles see `active` = 0.

    With `swarm_reward="team"` all share minus the attacker's payoff. With `"local"` each is charged for its own speed
    error, -100/K_s |v - v_d|/v_d per integration step, and for its own collision: another objective than the payoff.
    """

    def __init__(self, game: DisbandingGame) -> None:
        if game.config.defense_action != "vehicle":
            raise ConfigurationError('the swarm form needs defense_action="vehicle", one correction per vehicle')
        self._game = game
        self.agents = tuple(f"vehicle_{q}" for q in range(game.config.max_vehicles))
        self.fields = vehicle_fields(game.config)
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self._charged = np.zeros((game.num_envs, len(self.agents)))

    def observe(self) -> Observation:
        """Own rows (B, M, size), see `fields.vehicle_fields`."""
        game = self._game
        envs, agents = game.num_envs, len(self.agents)
        values = np.empty((envs, agents, self.fields.size))
        observe_vehicles(game.state, game.parameters, values)
        return self.fields.encode(values.reshape(-1, self.fields.size)).reshape(values.shape)

    def join(self, actions: Array) -> Array:
        """The defender's action (B, M) from (B, M, 1)."""
        return actions[..., 0]

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, M) of the last step."""
        if self._game.config.swarm_reward == "team":
            return np.repeat(-payoff[:, np.newaxis], len(self.agents), axis=1)
        before, self._charged = self._charged, self._charges()
        fresh = self._game.elapsed[:, np.newaxis] <= 1
        return np.where(fresh, 0.0, before) - self._charged

    def _charges(self) -> FloatArray:
        """What each vehicle has been charged for since the start of the episode, (B, M)."""
        game = self._game
        percent = 100.0 / (game.config.horizon_steps * game.config.desired_speed_mps)
        charge: FloatArray = percent * game.state.speed_error
        return charge + game.config.collision_penalty * game.state.collided_intact
