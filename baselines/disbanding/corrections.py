"""Defenders that correct commands, and the simplest of them: copying the disbanded vehicle ahead."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import AnalyticPolicy, RoleSpec, State
from cps_envs.core.types import Array, BoolArray, FloatArray

Seen = Mapping[str, FloatArray]  # the defender's decoded observation
SPEED_MATCHING = 1.0  # 1/s, chosen; 0.5 to 4 give the same errors within 0.1 points


class Corrections(AnalyticPolicy):
    """Base of central defenders: corrections (B, M) in m/s2 from decoded observations, one per vehicle.

    Raises:
        ConfigurationError: the environment takes one correction per platoon.
    """

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec)
        if spec.config.defense_action != "vehicle":
            raise ConfigurationError(f'{type(self).__name__} corrects vehicles; it needs defense_action="vehicle"')
        self.limit_mps2 = spec.config.max_acceleration_mps2 - spec.config.min_acceleration_mps2

    def predict(
        self,
        observation: Array,
        state: State = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State]:
        """Actions (B, M): corrections as shares of u_max - u_min; zero where none would act."""
        seen = self.spec.fields.decode(observation)
        if not (seen["disbanded"] > 0.5).any():
            return np.zeros((len(observation), self.spec.config.max_vehicles)), state
        corrections = np.where(self.mitigable(seen), self.corrections(seen), 0.0)
        return np.clip(corrections / self.limit_mps2, -1.0, 1.0), state

    @abstractmethod
    def corrections(self, seen: Seen) -> FloatArray:
        """Corrections (B, M) in m/s2; those of vehicles that are not mitigable are ignored."""

    def mitigable(self, seen: Seen) -> BoolArray:
        """Vehicles (B, M) on which a correction acts."""
        front = self.spec.config.vehicles_per_platoon
        mitigable: BoolArray = np.pad(seen["mitigable"] > 0.5, ((0, 0), (front, 0)))
        return mitigable

    def by_vehicle(self, rows: FloatArray, seen: Seen) -> FloatArray:
        """Values (B, M) of the vehicles from values (B, N - 1) of platoons 1..N-1; the front platoon gets zeros."""
        config = self.spec.config
        platoons = config.max_platoons
        present = np.sum(seen["present"] > 0.5, axis=1) if "present" in seen else np.full(len(rows), platoons)
        row = present[:, np.newaxis] - 1 - np.arange(platoons)  # of each platoon, front to rear
        padded = np.pad(rows, ((0, 0), (0, 1)))
        padded = np.where(np.arange(platoons) < present[:, np.newaxis] - 1, padded, 0.0)
        return np.repeat(np.take_along_axis(padded, np.maximum(row, 0), axis=1), config.vehicles_per_platoon, axis=1)


class CopyDisbanded(Corrections):
    """Extension beyond the paper: every vehicle copies the command of the nearest disbanded vehicle ahead.

    Needs a broadcast of that command and of that vehicle's speed. Copying keeps the gaps of the steady state, and its
    error is that of the vehicle copied, whatever the number of platoons. A bounded correction cannot follow a driver
    who commands -90 m/s2, so the speed that is lost at first is matched again at `SPEED_MATCHING`.
    """

    def corrections(self, seen: Seen) -> FloatArray:
        """The copied command, with the speeds matched, minus the law's."""
        lag = self.by_vehicle(seen["ahead_speed"], seen) - seen["speed"]
        return self.by_vehicle(seen["ahead_command"], seen) + SPEED_MATCHING * lag - seen["law_command"]
