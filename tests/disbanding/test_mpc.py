"""Model predictive control: its quadratic programs, what it asks for, and what its solvers agree on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import LinearConstraint, minimize

from cps_baselines.disbanding.mpc import (
    BEST_TUNED,
    PAPER_MATCHING,
    MpcSettings,
    OwnMotion,
    Preceding,
    assemble,
    design_mpc,
    design_of,
    mpc_scratch,
    predictive_command,
    stack_mpc,
)
from cps_baselines.disbanding.quadratic_program import QuadraticProgram, quadratic_program
from cps_envs.core.compute.kernels import unpack
from cps_envs.disbanding.state import Constants
from tests.disbanding.programs import EXACT, by_library, hildreth
from tests.disbanding.table_2_1 import CELLS, LEAD, metrics, run_mpc, start, table_2_1

CONSTANTS = unpack(Constants, table_2_1(), 0)
SETTINGS = [PAPER_MATCHING, BEST_TUNED]


def random_program(
    rng: np.random.Generator, size: int = 5, rows: int = 8
) -> tuple[QuadraticProgram, np.ndarray, np.ndarray]:
    """A program with a feasible point, whose unconstrained optimum violates some rows."""
    root = rng.normal(size=(size, size))
    matrix = rng.normal(size=(rows, size))
    limits = matrix @ rng.normal(size=size) + rng.uniform(0.0, 0.5, rows)
    return quadratic_program(root @ root.T + np.eye(size), matrix), 3.0 * rng.normal(size=size), limits


@pytest.mark.parametrize("seed", range(12))
def test_solvers_agree(seed: int) -> None:
    qp, linear, limits = random_program(np.random.default_rng(seed))
    scipy = minimize(
        lambda u: 0.5 * u @ qp.hessian @ u + linear @ u,
        np.zeros(len(linear)),
        jac=lambda u: qp.hessian @ u + linear,
        constraints=LinearConstraint(qp.rows, ub=limits),
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 200},
    )
    np.testing.assert_allclose(by_library(qp, linear, limits), scipy.x, atol=1e-5)
    np.testing.assert_allclose(hildreth(qp, linear, limits, EXACT), scipy.x, atol=1e-5)


@given(size=st.integers(1, 8), rows=st.integers(1, 12), seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_strictly_convex_programs_are_solved_as_osqp_does(size: int, rows: int, seed: int) -> None:
    """With a feasible point, within 1e-5 of commands of order 1: OSQP ends at 1e-8, the dual iteration at 1e-12."""
    qp, linear, limits = random_program(np.random.default_rng(seed), size, rows)
    np.testing.assert_allclose(hildreth(qp, linear, limits, EXACT), by_library(qp, linear, limits), atol=1e-5)


@pytest.mark.parametrize("seed", range(12))
def test_optimality_conditions(seed: int) -> None:
    qp, linear, limits = random_program(np.random.default_rng(100 + seed))
    multipliers = np.zeros(len(limits))
    solution = hildreth(qp, linear, limits, EXACT, multipliers)
    slack = limits - qp.rows @ solution
    assert (multipliers >= 0.0).all()
    np.testing.assert_allclose(qp.hessian @ solution + linear + qp.rows.T @ multipliers, 0.0, atol=1e-9)
    assert slack.min() > -1e-7
    np.testing.assert_allclose(multipliers * slack, 0.0, atol=1e-6)


def test_a_warm_start_continues() -> None:
    qp, linear, limits = random_program(np.random.default_rng(4))
    multipliers = np.zeros(len(limits))
    once, again = (hildreth(qp, linear, limits, multipliers=multipliers) for _ in range(2))
    np.testing.assert_allclose(once, hildreth(qp, linear, limits), atol=1e-9)
    exact = by_library(qp, linear, limits)
    assert np.abs(again - exact).max() <= np.abs(once - exact).max() + 1e-9


def test_the_cap_bounds_the_work() -> None:
    qp, linear, limits = random_program(np.random.default_rng(104))
    capped, exact = hildreth(qp, linear, limits), hildreth(qp, linear, limits, EXACT)
    assert 1e-6 < np.abs(capped - exact).max() < 0.2


def test_infeasible_programs_end() -> None:
    qp = design_mpc(PAPER_MATCHING, 0.3).qp
    limits = np.full(len(qp.rows), -100.0)
    assert np.isfinite(hildreth(qp, np.ones(5), limits)).all()


def predict(
    error: np.ndarray, commands: np.ndarray, command_ahead: float, settings: MpcSettings, tau_s: float
) -> np.ndarray:
    """Errors (H, 3) of the model (A.2), period by period."""
    period, errors = settings.period_s, []
    for command in commands:
        gap, closing, relative = error
        rate = period / tau_s
        error = np.array(
            [
                gap + period * closing,
                closing + period * relative,
                relative + rate * (command_ahead - command - relative),
            ]
        )
        errors.append(error)
    return np.array(errors)


@pytest.mark.parametrize("tau_s", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("settings", SETTINGS, ids=lambda settings: settings.name)
def test_matrices_are_cost_and_constraints_of_the_model(settings: MpcSettings, tau_s: float) -> None:
    rng = np.random.default_rng(5)
    mpc, horizon = design_mpc(settings, tau_s), settings.horizon
    error, ahead, desired_gap = rng.normal(size=3), Preceding(12.0, -0.7, -1.3), 5.0
    linear, limits = np.empty(horizon), np.empty(5 * horizon - 4)
    assemble(mpc.model, error, desired_gap, ahead, CONSTANTS, linear, limits)
    weights = np.array([settings.error_weights] * (horizon - 1) + [settings.terminal_weights])

    def cost(commands: np.ndarray) -> float:
        errors = predict(error, commands, ahead[2], settings, tau_s)
        return float((weights * errors**2).sum() + settings.command_weight * (commands**2).sum())

    speed_ahead, acceleration_ahead = [ahead[0]], ahead[1]
    for _ in range(horizon):
        speed_ahead.append(speed_ahead[-1] + settings.period_s * acceleration_ahead)
        acceleration_ahead += settings.period_s * (ahead[2] - acceleration_ahead) / tau_s
    for _ in range(5):
        commands = rng.uniform(-5.0, 1.0, horizon)
        ours = commands @ mpc.qp.hessian @ commands + 2.0 * linear @ commands
        assert ours == pytest.approx(cost(commands) - cost(np.zeros(horizon)), rel=1e-9, abs=1e-8)
        errors = predict(error, commands, ahead[2], settings, tau_s)
        gaps, speeds = desired_gap + errors[:, 0], np.array(speed_ahead[1:]) - errors[:, 1]
        slack = np.concatenate([gaps[2:], 36.0 - speeds[1:], speeds[1:], 1.0 - commands, commands + 5.0])
        np.testing.assert_allclose(limits - mpc.qp.rows @ commands, slack, atol=1e-9)


@pytest.mark.parametrize("settings", SETTINGS, ids=lambda settings: settings.name)
def test_command_is_the_first_of_the_optimum(settings: MpcSettings) -> None:
    rng = np.random.default_rng(11)
    mpc = design_mpc(settings, 0.3)
    horizon = settings.horizon
    linear, limits, constrained = np.empty(horizon), np.empty(5 * horizon - 4), 0
    room = mpc_scratch(stack_mpc(settings, np.array([0.3])))
    for _ in range(60):
        gap, speed, acceleration = rng.uniform(4.0, 12.0), rng.uniform(5.0, 30.0), rng.uniform(-2.0, 1.0)
        ahead = Preceding(speed + rng.uniform(-0.5, 0.5), rng.uniform(-2.0, 1.0), rng.uniform(-3.0, 1.0))
        multipliers = np.zeros(len(limits))
        own = OwnMotion(gap, 5.0, speed, acceleration)
        ours = predictive_command(own, ahead, CONSTANTS, mpc, multipliers, room)
        error = np.array([gap - 5.0, ahead[0] - speed, ahead[1] - acceleration])
        assemble(mpc.model, error, 5.0, ahead, CONSTANTS, linear, limits)
        assert ours == pytest.approx(np.clip(by_library(mpc.qp, linear, limits)[0], -5.0, 1.0), abs=2e-3)
        constrained += bool(multipliers.any())
    assert constrained > 5


def test_a_standing_predecessor_does_not_drive_backward() -> None:
    mpc, zeros = design_mpc(PAPER_MATCHING, 0.3), np.zeros(21)
    own, room = OwnMotion(3.0, 5.0, 2.0, -1.0), mpc_scratch(stack_mpc(PAPER_MATCHING, np.array([0.3])))
    braking, idle = (
        predictive_command(own, Preceding(0.0, 0.0, command), CONSTANTS, mpc, zeros.copy(), room)
        for command in (-5.0, 0.0)
    )
    assert braking == idle


@pytest.mark.parametrize("tau_s", [0.01, 0.049])
def test_a_lag_below_half_the_period_is_refused(tau_s: float) -> None:
    with pytest.raises(ValueError, match=r"tau_s = .* choose period_s <= .* larger tau_s"):
        design_mpc(PAPER_MATCHING, tau_s)
    with pytest.raises(ValueError, match="tau_s"):
        stack_mpc(PAPER_MATCHING, np.array([0.1, tau_s]))


def test_a_stack_holds_the_designs() -> None:
    taus_s = np.array([0.1, 0.4])
    stack = stack_mpc(PAPER_MATCHING, taus_s)
    for b, tau_s in enumerate(taus_s):
        ours, single = design_of(stack, b), design_mpc(PAPER_MATCHING, float(tau_s))
        np.testing.assert_equal((*ours.model, *ours.qp), (*single.model, *single.qp))


def test_best_tuned_is_far_below_the_paper() -> None:
    """Section 8.7: 18.7 to 20.5 percent, against 22.8 to 29.7 in the paper's mpc column."""
    parameters = table_2_1(6, desired_gap_m=[x for x, _ in CELLS], tau_s=[tau for _, tau in CELLS])
    state = start(parameters, LEAD)
    run_mpc(state, parameters, 180.0, BEST_TUNED)
    errors = [metrics(state, parameters, b)["velocity_error_intact"] for b in range(6)]
    np.testing.assert_allclose([min(errors), max(errors)], [18.7, 20.5], atol=0.06)
    assert not state.collided.any()
