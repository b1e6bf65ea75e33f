"""The decentralised defence: one agent per vehicle, each with its own row of sensors and its own correction."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.team import Team
from cps_envs.core.types import Array, FloatArray, IntArray, Observation
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.fields import vehicle_fields
from cps_envs.disbanding.observation import observe_vehicles
from cps_envs.disbanding.state import State


class VehicleTeam(Team):
    """Agents `vehicle_0` (front) to `vehicle_{M-1}`; the set is constant, disbanded vehicles see `active` = 0.

    With `swarm_reward="team"` all share minus the attacker's payoff. With `"local"` each is charged for its own speed
    error, -100/K_s |v - v_d|/v_d per integration step, and for its own collision: another objective than the payoff.
    `elapsed` (B,) is the game's own count of its steps.
    """

    def __init__(self, config: DisbandingConfig, state: State, constants: Array, elapsed: IntArray) -> None:
        if config.defense_action != "vehicle":
            raise ConfigurationError('the swarm form needs defense_action="vehicle", one correction per vehicle')
        self._config, self._state, self._constants, self._elapsed = config, state, constants, elapsed
        self.agents = tuple(f"vehicle_{q}" for q in range(config.max_vehicles))
        self.fields = vehicle_fields(config)
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self._charged = np.zeros((len(constants), len(self.agents)))

    def observe(self) -> Observation:
        """Own rows (B, M, size), see `fields.vehicle_fields`."""
        encoded = np.empty((len(self._constants), len(self.agents), self.fields.size), np.float32)
        observe_vehicles(self._state, self._constants, self.fields.offsets, self.fields.scale, encoded)
        return encoded

    def join(self, actions: Array) -> Array:
        """The defender's action (B, M) from (B, M, 1)."""
        return actions[..., 0]

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, M) of the last step."""
        if self._config.swarm_reward == "team":
            return np.repeat(-payoff[:, np.newaxis], len(self.agents), axis=1)
        before, self._charged = self._charged, self._charges()
        fresh = self._elapsed[:, np.newaxis] <= 1
        return np.where(fresh, 0.0, before) - self._charged

    def _charges(self) -> FloatArray:
        """What each vehicle has been charged for since the start of the episode, (B, M)."""
        config = self._config
        percent = 100.0 / (config.horizon_steps * config.desired_speed_mps)
        charge: FloatArray = percent * self._state.speed_error
        return charge + config.collision_penalty * self._state.collided_intact
