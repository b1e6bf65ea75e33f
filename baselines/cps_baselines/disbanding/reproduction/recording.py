"""A simulation with its course kept, and what can be read from it: gaps, stops, and when traffic has recovered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_baselines.disbanding.reproduction.scenario import Outcome, Scenario, begin, driver, outcome
from cps_baselines.reproduction.verdicts import SAME_SHARE, deviation, recovery_s
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.config import DisbandingConfig


@dataclass(frozen=True)
class Recorded:
    """A scenario whose course is kept every `sample_s` seconds."""

    scenario: Scenario
    sample_s: float

    @property
    def cost(self) -> float:
        """How long it takes, relative to others."""
        return self.scenario.cost

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return self.scenario.label

    def run(self) -> Record:
        """Simulate it to the end."""
        state, constants = begin(self.scenario)
        advance = driver(self.scenario, state, constants)
        config = self.scenario.config
        steps = round(self.sample_s / config.dynamics.dt_s)
        samples = config.horizon_steps // steps
        position, speed = np.empty((2, samples + 1, config.max_vehicles))
        position[0], speed[0] = state.position[0], state.speed[0]
        for k in range(samples):
            advance(steps)
            position[k + 1], speed[k + 1] = state.position[0], state.speed[0]
        time_s = np.arange(samples + 1, dtype=np.float64) * self.sample_s
        return Record(config, time_s, position, speed, outcome(state, constants, config.horizon_steps))


@dataclass(frozen=True)
class Record:
    """The course of a simulation, T samples of M vehicles, front to rear."""

    config: DisbandingConfig
    time_s: FloatArray  # (T,)
    position_m: FloatArray  # (T, M)
    speed_mps: FloatArray  # (T, M)
    outcome: Outcome

    def vehicles(self, platoon: int) -> slice:
        """The columns of a platoon, counted from the rear as the paper does, its leader first."""
        size = self.config.vehicles_per_platoon
        first = (self.config.max_platoons - platoon) * size
        return slice(first, first + size)

    def inner_gaps(self, platoon: int) -> FloatArray:
        """The gaps (T, n - 1) in m between the vehicles of a platoon."""
        return -np.diff(self.position_m[:, self.vehicles(platoon)], axis=1)

    def settled_s(self, platoon: int, share: float = SAME_SHARE) -> float | None:
        """When all inner gaps of a platoon are back for good; None if never."""
        gaps = self.inner_gaps(platoon)
        return recovery_s(self.time_s, deviation(gaps, gaps[0], gaps[0]), share)

    def recovered_s(self, share: float = SAME_SHARE) -> float | None:
        """When all speeds, and all gaps of the intact vehicles, are back for good; None if never.

        Without an attack all keep what they begin with, the steady state. Human drivers keep larger gaps.
        """
        gaps = -np.diff(self.position_m, axis=1)[:, self.outcome.intact[1:]]
        speeds = deviation(self.speed_mps, self.speed_mps[0], self.config.desired_speed_mps)
        return recovery_s(self.time_s, np.maximum(speeds, deviation(gaps, gaps[0], gaps[0])), share)

    def duration_s(self, holds: BoolArray) -> float:
        """For how long a condition (T,) holds, in total."""
        return float(np.count_nonzero(holds) * (self.time_s[1] - self.time_s[0]))
