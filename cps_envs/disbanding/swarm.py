"""The decentralised defence: one agent per vehicle, each with its own row of sensors and its own correction."""

from __future__ import annotations

import numpy as np

from cps_envs.core.declare.objective import is_own
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.team import Team, shared_alike
from cps_envs.core.types import Array, FloatArray, IntArray, Observation
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.fields import vehicle_fields
from cps_envs.disbanding.observation import observe_vehicles
from cps_envs.disbanding.state import State
from cps_envs.disbanding.truth import truth_of_platoons


class VehicleTeam(Team):
    """Agents `vehicle_0` (front) to `vehicle_{M-1}`; the set is constant, disbanded vehicles see `active` = 0.

    With `swarm_reward="team"` all share minus the attacker's payoff. With `"local"` each is paid for its own part of
    it: its speed error, 100/K_s |v - v_d|/v_d / M per integration step, and its own collision. What has no owner, such
    as the charge of an early end, all bear alike. So the parts of all vehicles sum to minus the payoff.
    Another `payoff` all bear alike, too.
    `elapsed` (B,) is the game's own count of its steps, `budget` (B,) the attacks that are left.
    """

    def __init__(
        self, config: DisbandingConfig, state: State, constants: Array, budget: IntArray, elapsed: IntArray
    ) -> None:
        if config.defense_action != "vehicle":
            raise ConfigurationError('the swarm form needs defense_action="vehicle", one correction per vehicle')
        self._config, self._state, self._constants, self._elapsed = config, state, constants, elapsed
        self._budget = budget
        self.agents = tuple(f"vehicle_{q}" for q in range(config.max_vehicles))
        self._fields = vehicle_fields(config)
        self._charged = np.zeros((len(constants), len(self.agents)))

    def observe(self) -> Observation:
        """Own rows (B, M, size), see `fields.vehicle_fields`."""
        encoded = np.empty((len(self._constants), len(self.agents), self._fields.size), np.float32)
        observe_vehicles(self._state, self._constants, self._fields.offsets, self._fields.scale, encoded)
        return encoded

    def privileged(self) -> Observation:
        """What each vehicle does not see, (B, M, p), see `truth.truth_of_platoons`."""
        truth = truth_of_platoons(self._config, self._state, self._constants, self._budget)
        return np.repeat(truth, self._config.vehicles_per_platoon, axis=1)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, M) of the last step."""
        if self._config.swarm_reward == "team":
            return np.repeat(-payoff[:, np.newaxis], len(self.agents), axis=1)
        if not is_own(self._config):
            return shared_alike(payoff, len(self.agents))
        before, self._charged = self._charged, self._charges()
        fresh = self._elapsed[:, np.newaxis] <= 1
        own = np.where(fresh, 0.0, before) - self._charged
        present = np.arange(len(self.agents)) < self._constants["num_vehicles"][:, np.newaxis]
        common = (-payoff - own.sum(axis=1)) / present.sum(axis=1)
        rewards: FloatArray = own + present * common[:, np.newaxis]
        return rewards

    def _charges(self) -> FloatArray:
        """What each vehicle has been charged for since the start of the episode, (B, M)."""
        config = self._config
        vehicles = self._constants["num_vehicles"][:, np.newaxis]
        percent = 100.0 / (config.horizon_steps * config.desired_speed_mps)
        speed_error = percent * self._state.speed_error if config.payoff_set == "all" else 0.0
        charge: FloatArray = (speed_error + config.collision_penalty * 100.0 * self._state.collided_intact) / vehicles
        return charge
