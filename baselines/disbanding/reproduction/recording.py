"""A simulation with its course kept, and what can be read from it: gaps, stops, and when traffic has recovered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from baselines.disbanding.reproduction.scenario import Outcome, Scenario, begin, driver, outcome
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.config import DisbandingConfig

GAP_SHARE, SPEED_SHARE = 0.10, 0.05  # of the desired value; chosen: within these, a vehicle counts as recovered


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

    def gap_errors(self) -> FloatArray:
        """Gap minus desired gap as a share of the desired one, (T, M - 1); desired is h v for leaders, else x_d."""
        leads = np.arange(1, self.config.max_vehicles) % self.config.vehicles_per_platoon == 0
        follower = np.full_like(self.speed_mps[:, 1:], self.config.desired_gap_m)
        desired = np.where(leads, self.config.headway_s * self.speed_mps[:, 1:], follower)
        errors: FloatArray = (-np.diff(self.position_m, axis=1) - desired) / self.config.desired_gap_m
        return errors

    def settled_s(self, platoon: int) -> float | None:
        """When all inner gaps of a platoon are within GAP_SHARE of the desired one for good; None if never."""
        errors = np.abs(self.inner_gaps(platoon) / self.config.desired_gap_m - 1.0)
        return self.last_true(errors.max(axis=1) > GAP_SHARE)

    def recovered_s(self) -> float | None:
        """When all gaps and speeds of the intact vehicles are within their shares for good; None if never.

        A leader's gap may be off by GAP_SHARE of x_d, too. Human drivers keep larger gaps and are left out of these.
        """
        desired = self.config.desired_speed_mps
        speed_error = np.abs(self.speed_mps - desired).max(axis=1)
        gap_error = np.abs(self.gap_errors()[:, self.outcome.intact[1:]]).max(axis=1)
        return self.last_true((speed_error > SPEED_SHARE * desired) | (gap_error > GAP_SHARE))

    def duration_s(self, holds: BoolArray) -> float:
        """For how long a condition (T,) holds, in total."""
        return float(np.count_nonzero(holds) * (self.time_s[1] - self.time_s[0]))

    def last_true(self, condition: BoolArray) -> float | None:
        """The first sample after which a condition (T,) never holds again; None if it holds at the end."""
        if condition[-1]:
            return None
        held = np.flatnonzero(condition)
        return float(self.time_s[held[-1] + 1]) if len(held) else 0.0
