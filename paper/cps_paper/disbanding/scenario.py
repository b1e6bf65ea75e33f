"""One deterministic simulation of the chapter: who is disbanded when, and what became of it.

With its course kept one can read gaps, stops, and when traffic has recovered.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_baselines.disbanding.mpc import PAPER_MATCHING, stack_mpc
from cps_envs.core.compute.kernels import pack
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.dynamics import advance
from cps_envs.disbanding.payoff import measured
from cps_envs.disbanding.start import nominal_constants, place, undisturbed
from cps_envs.disbanding.state import State, allocate
from cps_paper.disbanding.closed_loop import advance_with_heuristic, advance_with_mpc, mpc_memory
from cps_paper.verdicts import SAME_SHARE, deviation, recovery_s

Attack = tuple[tuple[int, float], ...]  # (paper platoon, 1 = rear; time in s)
Overrides = tuple[tuple[str, Any], ...]  # fields of the configuration
Advance = Callable[[int], None]  # by so many integration steps
CONTROLLERS = ("baseline", "heuristic", "mpc")
MPC_COST, HEURISTIC_COST = 6.0, 2.5  # relative to the plain law


@dataclass(frozen=True)
class ScenarioOutcome:
    """What a simulation ended with; arrays run over the vehicles (M,), front to rear."""

    velocity_error_all: float  # percent, (2.8) over all vehicles
    velocity_error_intact: float  # percent, (2.8) over the vehicles of platoons never disbanded
    intact: BoolArray
    stops: IntArray  # how often a vehicle came to a stop
    collided: BoolArray  # involved in a collision
    rear_collided: BoolArray  # ran into the vehicle ahead

    @property
    def crash(self) -> bool:
        """Whether there was any collision."""
        return bool(self.collided.any())

    def stopped_share(self, times: int = 1) -> float:
        """Percent of the intact vehicles that stopped at least so often."""
        return 100.0 * float(np.mean(self.stops[self.intact] >= times))

    def collided_share(self) -> float:
        """Percent of the intact vehicles that were involved in a collision."""
        return 100.0 * float(np.mean(self.collided[self.intact]))


@dataclass(frozen=True)
class Scenario:
    """A simulation from the steady state; parameters not named here are those of Table 2.1."""

    attack: Attack
    tau_s: float = 0.1
    desired_gap_m: float = 5.0
    controller: str = "baseline"
    interpretation: str = "S0"
    num_platoons: int = 10
    duration_s: float = 180.0
    overrides: Overrides = ()  # of parameters that are not named above

    @property
    def config(self) -> DisbandingConfig:
        """The configuration that it shares with the environments."""
        return DisbandingConfig(
            num_platoons=self.num_platoons,
            duration_s=self.duration_s,
            tau_s=self.tau_s,
            desired_gap_m=self.desired_gap_m,
            interpretation=self.interpretation,
            **dict(self.overrides),
        )

    @property
    def cost(self) -> float:
        """How long it takes, relative to others."""
        factor = {"baseline": 1.0, "heuristic": HEURISTIC_COST, "mpc": MPC_COST}[self.controller]
        return factor * self.num_platoons * self.config.horizon_steps

    @property
    def label(self) -> str:
        """A few words for a progress bar."""
        return f"{self.controller}, N = {self.num_platoons}, tau = {self.tau_s:g} s"

    def run(self) -> ScenarioOutcome:
        """Simulate it to the end."""
        state, constants = begin(self)
        steps = self.config.horizon_steps
        driver(self, state, constants)(steps)
        return outcome(state, constants, steps)


def begin(scenario: Scenario) -> tuple[State, Array]:
    """One episode at time 0 with the attack written into it, and its constants (1,)."""
    config = scenario.config
    constants = pack(nominal_constants(config))
    state = allocate(1, config.max_platoons, config.vehicles_per_platoon)
    place(state, constants, undisturbed(constants, config.max_vehicles), np.ones(1, np.bool_))
    for platoon, time_s in scenario.attack:
        state.disbanding_s[0, config.max_platoons - platoon] = time_s
    return state, constants


def driver(scenario: Scenario, state: State, constants: Array) -> Advance:
    """The closed loop of the scenario's controller: every step for the heuristic, the MPC by its own period."""
    envs = np.ones(1, np.bool_)
    zeros = np.zeros_like(state.position)
    if scenario.controller == "baseline":
        return lambda steps: advance(state, constants, zeros, envs, steps)
    if scenario.controller == "heuristic":
        return lambda steps: advance_with_heuristic(state, constants, envs, steps)
    mpc = stack_mpc(PAPER_MATCHING, constants["tau_s"])
    memory = mpc_memory(mpc, zeros.shape[1])
    return lambda steps: advance_with_mpc(state, constants, envs, steps, mpc, PAPER_MATCHING.release, memory)


def outcome(state: State, constants: Array, horizon_steps: int) -> ScenarioOutcome:
    """Read the first episode."""
    metrics = measured(state, constants, horizon_steps)[0]
    size = int(constants["vehicles_per_platoon"][0])
    return ScenarioOutcome(
        velocity_error_all=float(metrics["velocity_error_all"]),
        velocity_error_intact=float(metrics["velocity_error_intact"]),
        intact=np.repeat(np.isinf(state.disbanding_s[0]), size),
        stops=state.stops[0].copy(),
        collided=state.collided[0].copy(),
        rear_collided=state.rear_collided[0].copy(),
    )


@dataclass(frozen=True)
class ScenarioCourse(ScenarioOutcome):
    """An outcome and what led to it, T samples of M vehicles, front to rear."""

    config: DisbandingConfig
    time_s: FloatArray  # (T,)
    position_m: FloatArray  # (T, M)
    speed_mps: FloatArray  # (T, M)

    def vehicles(self, platoon: int) -> slice:
        """The columns of a platoon, counted from the rear as the paper does, its leader first."""
        size = self.config.vehicles_per_platoon
        first = (self.config.max_platoons - platoon) * size
        return slice(first, first + size)

    def inner_gaps(self, platoon: int) -> FloatArray:
        """The gaps (T, n - 1) in m between the vehicles of a platoon."""
        return -np.diff(self.position_m[:, self.vehicles(platoon)], axis=1)

    def rear_speeds_mps(self, platoons: Sequence[int]) -> FloatArray:
        """The speeds (T, len(platoons)) of the last vehicles of these platoons."""
        return self.speed_mps[:, [self.vehicles(platoon).stop - 1 for platoon in platoons]]

    def settled_s(self, platoon: int, share: float = SAME_SHARE) -> float | None:
        """When all inner gaps of a platoon are back for good; None if never."""
        gaps = self.inner_gaps(platoon)
        return recovery_s(self.time_s, deviation(gaps, gaps[0], gaps[0]), share)

    def recovered_s(self, share: float = SAME_SHARE) -> float | None:
        """When all speeds, and all gaps of the intact vehicles, are back for good; None if never.

        Without an attack all keep what they begin with, the steady state. Human drivers keep larger gaps.
        """
        gaps = -np.diff(self.position_m, axis=1)[:, self.intact[1:]]
        speeds = deviation(self.speed_mps, self.speed_mps[0], self.config.desired_speed_mps)
        return recovery_s(self.time_s, np.maximum(speeds, deviation(gaps, gaps[0], gaps[0])), share)

    def duration_s(self, holds: BoolArray) -> float:
        """For how long a condition (T,) holds, in total."""
        return float(np.count_nonzero(holds) * (self.time_s[1] - self.time_s[0]))


@dataclass(frozen=True)
class Recorded(Scenario):
    """A scenario whose course is kept every `sample_s` seconds."""

    sample_s: float = 0.2

    def run(self) -> ScenarioCourse:
        """Simulate it to the end."""
        state, constants = begin(self)
        advance, config = driver(self, state, constants), self.config
        steps = round(self.sample_s / config.dynamics.dt_s)
        samples = config.horizon_steps // steps
        position, speed = np.empty((2, samples + 1, config.max_vehicles))
        position[0], speed[0] = state.position[0], state.speed[0]
        for k in range(samples):
            advance(steps)
            position[k + 1], speed[k + 1] = state.position[0], state.speed[0]
        time_s = np.arange(samples + 1, dtype=np.float64) * self.sample_s
        ended = outcome(state, constants, config.horizon_steps)
        return ScenarioCourse(**vars(ended), config=config, time_s=time_s, position_m=position, speed_mps=speed)
