"""The roles as teams of one agent for each sensor: what each is paid, and what critics may be told."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

import numpy as np

from cps_envs.core.declare.objective import is_own
from cps_envs.core.policies.team import Team
from cps_envs.core.types import BoolArray, FloatArray, Observation
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import Model
from cps_envs.hvac.sensors import sensor_names, sensors_of_choices, zones_of_sensors
from cps_envs.hvac.state import State

# All chosen: what critics are told is about 1 at these sizes, and limited to `MOST`.
ERROR_C, LIE_C, IMPACT_C2 = 3.0, 4.0, 16.0
MOST = 5.0


class SensorTeam(Team):
    """Agents `sensor_1` to `sensor_S` of a role. They look at the state of a game."""

    def __init__(self, config: HvacConfig, model: Model, state: State) -> None:
        self.agents = sensor_names(config)
        self._config, self._model, self._state = config, model, state
        self._zone, self._used = zones_of_sensors(config), sensors_of_choices(config)

    def privileged(self) -> Observation:
        """What this side does not see, (B, S, p), see `told`."""
        shape = self._state.reading.shape
        columns = [np.broadcast_to(column, shape) for column in self.told()]
        return np.clip(np.stack(columns, axis=-1), -MOST, MOST).astype(np.float32)

    @abstractmethod
    def told(self) -> Sequence[FloatArray]:
        """Columns (B, S) or (B, 1) of about unit size for critics."""

    def _errors(self) -> FloatArray:
        """By how much zones are warmer than their set-points, (B, n) C."""
        state = self._state
        errors: FloatArray = state.temperature - self._model.reference[state.first + state.step]
        return errors

    def _attacked(self) -> BoolArray:
        """Whether the onset is reached, (B, 1)."""
        reached: BoolArray = self._state.step >= self._state.onset
        return reached[:, np.newaxis]


class Liars(SensorTeam):
    """The attacker's agents. Each is paid the whole payoff: a team's pay, not a share; it adds up to S times that."""

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """The payoff for each agent, (B, S)."""
        return np.repeat(payoff[:, np.newaxis], len(self.agents), axis=1)

    def told(self) -> Sequence[FloatArray]:
        """Whom the defender believes, how wrong its estimate is, and what was paid so far."""
        state, liars = self._state, self._state.compromised
        used = self._used[state.choice].astype(np.float64)
        fed_c = state.fed - state.temperature
        error_c = self._errors()
        return (
            used,
            (used * liars).sum(axis=1, keepdims=True),
            used.mean(axis=1, keepdims=True),
            fed_c[:, self._zone] / ERROR_C,
            (error_c**2).mean(axis=1, keepdims=True) / IMPACT_C2,
            np.sqrt(state.metrics["a_impact"] / IMPACT_C2)[:, np.newaxis],
        )


class Believers(SensorTeam):
    """The defender's agents. Each pays for the error of its sensor's zone; together they pay the payoff."""

    def __init__(self, config: HvacConfig, model: Model, state: State) -> None:
        super().__init__(config, model, state)
        self._alike = np.full(config.num_sensors, 1.0 / config.num_sensors)
        self._per_zone = config.num_sensors // config.num_zones

    def rewards(self, payoff: FloatArray) -> FloatArray:
        """Minus the payoff, (B, S), by the present squared errors of the zones; equal shares of any other payoff."""
        return -payoff[:, np.newaxis] * self._shares()

    def _shares(self) -> FloatArray:
        if not is_own(self._config):
            return self._alike
        squares = self._errors() ** 2
        total = squares.sum(axis=1, keepdims=True)
        shares = squares[:, self._zone] / np.where(total > 0, total, 1.0) / self._per_zone
        return np.where(total > 0, shares, self._alike)

    def told(self) -> Sequence[FloatArray]:
        """Who lies, by how much, the true errors, and how wrong the estimate is."""
        state, attacked = self._state, self._attacked()
        lies_c = (state.reading - state.measured) * attacked
        liars = (state.compromised & attacked).astype(np.float64)
        error_c = self._errors()
        return (
            liars,
            liars.sum(axis=1, keepdims=True) / 2.0,
            state.compromised.astype(np.float64),
            attacked.astype(np.float64),
            lies_c / LIE_C,
            np.abs(lies_c).sum(axis=1, keepdims=True) / (2.0 * LIE_C),
            error_c[:, self._zone] / ERROR_C,
            (error_c**2).mean(axis=1, keepdims=True) / IMPACT_C2,
            (state.fed - state.temperature)[:, self._zone] / ERROR_C,
        )
