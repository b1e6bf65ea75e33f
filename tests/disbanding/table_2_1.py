"""Environments with the parameters of Table 2.1, and what the tests do with them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from cps_baselines.disbanding.mpc import PAPER_MATCHING, MpcSettings, stack_mpc
from cps_envs.core.compute.kernels import records, unpack, view
from cps_envs.core.types import Array, FloatArray
from cps_envs.disbanding.config import INTERPRETATIONS
from cps_envs.disbanding.dynamics import advance, command_by_law
from cps_envs.disbanding.payoff import Metrics, measured
from cps_envs.disbanding.start import place, undisturbed
from cps_envs.disbanding.state import Constants, State, allocate
from cps_paper.disbanding.closed_loop import advance_with_heuristic, advance_with_mpc, mpc_memory

HORIZON_S = 180.0
CELLS = ((5.0, 0.1), (5.0, 0.3), (5.0, 0.5), (4.0, 0.1), (4.0, 0.3), (4.0, 0.5))  # (x_d in m, tau in s)
TABLE_2_1 = {
    "num_vehicles": 100,
    "vehicles_per_platoon": 10,
    "tau_s": 0.1,
    "desired_gap_m": 5.0,
    "headway_s": 1.5,
    "proportional_gain": 1.0,
    "derivative_gain": 5.0,
    "desired_speed_mps": 31.0,
    "min_speed_mps": 0.0,
    "max_speed_mps": 36.0,
    "min_acceleration_mps2": -5.0,
    "max_acceleration_mps2": 1.0,
    "standstill_gap_m": 1.0,
    "stop_at_collision": False,
}

MEASURED = Metrics._fields[: Metrics._fields.index("stopped_share") + 1]  # the others are charges

Attack = Iterable[tuple[int, float]]  # (paper platoon, time in s)
LEAD = ((10, 1.0),)
TWO = ((10, 2.0), (9, 100.0))


def table_2_1(num_envs: int = 1, interpretation: str = "S0", **changes: Any) -> Array:
    """Parameters (B,) of Table 2.1 with `changes`, each a value or one value per environment."""
    parameters = records(Constants, num_envs)
    for name, value in (TABLE_2_1 | asdict(INTERPRETATIONS[interpretation]) | changes).items():
        parameters[name] = value
    return parameters


def start(parameters: Array, attack: Attack = (), num_platoons: int = 10, **perturbation: Any) -> State:
    """Every environment in steady state with the same attack; paper platoons count from the rear."""
    state = allocate(len(parameters), num_platoons, int(parameters["vehicles_per_platoon"][0]))
    steady = undisturbed(parameters, state.position.shape[1])
    place(state, parameters, steady._replace(**perturbation), np.ones(len(parameters), np.bool_))
    for platoon, time_s in attack:
        state.disbanding_s[:, num_platoons - platoon] = time_s
    return state


def steps(parameters: Array, seconds: float) -> int:
    return round(seconds / float(parameters["dt_s"][0]))


def run(state: State, parameters: Array, seconds: float, correction: FloatArray | None = None) -> None:
    """Advance every environment with a constant correction (B, M), by default none."""
    correction = np.zeros_like(state.position) if correction is None else correction
    advance(state, parameters, correction, np.ones(len(parameters), np.bool_), steps(parameters, seconds))


def law_commands(state: State, parameters: Array) -> FloatArray:
    """Commands (B, M) that the plain law gives now."""
    gap, closing, law = (np.empty_like(state.position) for _ in range(3))
    for b in range(len(parameters)):
        command_by_law(view(state, b), unpack(Constants, parameters, b), gap[b], closing[b], law[b])
    return law


def run_heuristic(state: State, parameters: Array, seconds: float) -> None:
    """Advance every environment from the start under Algorithm 1."""
    advance_with_heuristic(state, parameters, np.ones(len(parameters), np.bool_), steps(parameters, seconds))


def run_mpc(state: State, parameters: Array, seconds: float, settings: MpcSettings = PAPER_MATCHING) -> None:
    """Advance every environment from the start under the predictive controller."""
    on, mpc = np.ones(len(parameters), np.bool_), stack_mpc(settings, parameters["tau_s"])
    memory = mpc_memory(mpc, state.position.shape[1])
    advance_with_mpc(state, parameters, on, steps(parameters, seconds), mpc, settings.release, memory)


def metrics(state: State, parameters: Array, b: int = 0) -> dict[str, float]:
    """The metrics of one environment over the paper's 180 s."""
    row = measured(state, parameters, steps(parameters, HORIZON_S))[b]
    return {name: float(row[name]) for name in MEASURED}
