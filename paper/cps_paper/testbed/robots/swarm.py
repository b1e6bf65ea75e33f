"""The decentralised defence on robots: one agent per robot, with the sensors of a vehicle of the string."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policies.team import Team
from cps_envs.core.types import Array, FloatArray, Observation
from cps_envs.disbanding.fields import vehicle_fields
from cps_envs.disbanding.observation import observe_vehicles
from cps_envs.disbanding.state import State
from cps_paper.testbed.robots.config import RobotConfig


class RobotTeam(Team):
    """Agents `robot_0` (front) to `robot_{M-1}`; all share minus the attacker's payoff.

    They see the filters' estimates in metres of road, laid out as in the swarm form of the disbanding problem.
    """

    def __init__(self, config: RobotConfig, string: State, constants: Array) -> None:
        self._string, self._constants = string, constants
        self.agents = tuple(f"robot_{q}" for q in range(config.num_robots))
        self._fields = vehicle_fields(config.road)

    def observe(self) -> Observation:
        """Own rows (B, M, size), see `disbanding.fields.vehicle_fields`."""
        encoded = np.empty((len(self._constants), len(self.agents), self._fields.size), np.float32)
        observe_vehicles(self._string, self._constants, self._fields.offsets, self._fields.scale, encoded)
        return encoded

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, M) of the last step."""
        return np.repeat(-payoff[:, np.newaxis], len(self.agents), axis=1)
