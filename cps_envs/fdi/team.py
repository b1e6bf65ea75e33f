"""The defence as a team of sensors: what each is charged for."""

from __future__ import annotations

import numpy as np

from cps_envs.core.declare.objective import is_own
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.team import Team, shared_alike
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.privileged import hidden_from_sensors
from cps_envs.fdi.state import State


def check_duel(config: FdiConfig) -> None:
    """Refuse what sensors cannot share.

    Raises:
        ConfigurationError: there is no filter, or the payoff is not the impact speed.
    """
    if config.estimator != "kalman" or config.goal != "collision":
        raise ConfigurationError(
            'a team of sensors needs estimator = "kalman" and goal = "collision", as in preset "learning", not '
            f"{config.estimator!r} and {config.goal!r}"
        )


def sensor_names(num_vehicles: int) -> tuple[str, ...]:
    """The front sensors of vehicles 1..n (1 = last), then the rear sensors of 2..n."""
    fronts = [f"front_{i}" for i in range(1, num_vehicles + 1)]
    return (*fronts, *(f"rear_{i}" for i in range(2, num_vehicles + 1)))


def sensor_gaps(num_vehicles: int) -> IntArray:
    """The gap (A,) that each sensor measures, by the vehicle behind it, 0 = last."""
    gaps: IntArray = np.r_[:num_vehicles, : num_vehicles - 1]
    return gaps


class SensorTeam(Team):
    """A = 2n - 1 sensors. Each pays for its own replaced readings, and its share of the impact in its gap.

    The impact is shared by the sensors of the gap, and the sensor at a vehicle's front pays for its corrections. The
    rewards sum to minus the payoff.

    `metrics` (B,) are records of `payoff.Metrics`, `over` (B,) marks episodes that have ended, `tasks` (T, R) the
    attacked readings of each task and `targets` (T,) the vehicle that is to collide.
    """

    def __init__(
        self, config: FdiConfig, state: State, metrics: Array, over: BoolArray, tasks: BoolArray, targets: IntArray
    ) -> None:
        check_duel(config)
        self.agents = sensor_names(config.num_vehicles)
        self._config, self._state, self._metrics, self._over = config, state, metrics, over
        self._tasks, self._targets, self._gaps = tasks, targets, sensor_gaps(config.num_vehicles)
        self._shares = self._gaps == np.arange(config.num_vehicles)[:, np.newaxis]  # (n, A)
        self._shares = self._shares / self._shares.sum(axis=1, keepdims=True)

    def privileged(self) -> Observation:
        """See `privileged.hidden_from_sensors`, (B, A, 11)."""
        return hidden_from_sensors(self._config, self._state, self._tasks[self._state.task], self._gaps)

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Rewards (B, A) of the last step, or of steps under one held action; equal shares of another `payoff`."""
        if not is_own(self._config):
            return shared_alike(payoff, len(self.agents))
        impact = np.where(self._over, np.minimum(self._metrics["impact_speed_mps"], payoff), 0.0)
        charges = self._charges()
        total = charges.sum(axis=1)
        part = np.where(total > 0, (payoff - impact) / np.where(total > 0, total, 1.0), 0.0)
        paid: FloatArray = charges * part[:, np.newaxis] + self._shares[self._hit()] * impact[:, np.newaxis]
        return -paid

    def _charges(self) -> FloatArray:
        """What a step costs each sensor without an impact, (B, A)."""
        config, state = self._config, self._state
        replaced = (state.trust == 0).reshape(len(state.trust), 2, -1).sum(axis=1)
        charges: FloatArray = config.dt_s * config.alarm_cost_mps2 * replaced
        n = config.num_vehicles
        charges[:, :n] += config.dt_s * config.correction_cost * np.abs(state.correction) / n
        return charges

    def _hit(self) -> IntArray:
        """The gap (B,) whose impact is paid, where there is one."""
        config, n = self._config, self._config.num_vehicles
        if config.paid_pair == "target":
            return self._targets[self._state.task]
        error, rate = self._state.error[:, :n], self._state.error[:, n:]
        hit: IntArray = np.where(error <= SLACK - config.desired_gap_m, -rate, -np.inf).argmax(axis=1)
        return hit
