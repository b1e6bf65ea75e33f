"""The controller that plans: its program against SciPy and OSQP on the stacked matrices, its limits, its levels."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import osqp
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from scipy.sparse import csc_matrix, eye

from cps_envs.core.types import Array
from cps_envs.hvac.building import discretise, weather
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.controller import predict
from cps_envs.hvac.game import HvacGame
from tests.hvac.games import QUIET, go, seen, started

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
SMALL = {"num_steps": 120, "window_steps": 30, "onset_step": 20, "prediction_steps": 12}
COLD = {"ground_c": 12.0, "outdoor_mean_c": 8.0, "outdoor_swing_c": 3.0}


class Stacked:
    """(4.17) at one step as least squares |D U - d| in the absolute heating U (N n,), from the matrices of (4.13)."""

    def __init__(self, config: HvacConfig, k: int, x: Any, dx: Any, before: Any) -> None:
        building = discretise(config)
        n, N, R = config.num_zones, config.prediction_steps, config.move_weight
        M1, M2, M3, M4 = predict(building, N)
        w = weather(config, config.step_s * np.arange(config.num_steps + N))
        dw = np.diff(w[max(k - 1, 0) : k + N] if k else np.vstack([w[:1], w[:N]]), axis=0).reshape(-1)
        moves = np.eye(n * N) - np.eye(n * N, k=-n)  # dU = moves U - first
        first = np.concatenate([before, np.zeros(n * (N - 1))])
        free = M1 @ x + M2 @ dx + M4 @ dw - M3 @ first
        self.D = np.vstack([M3 @ moves, np.sqrt(R) * moves])
        self.d = np.concatenate([config.reference_c - free, np.sqrt(R) * first])
        self.high, self.n = config.max_heating_w, n

    def bounded(self) -> Array:
        """The optimum (N, n) by bounded-variable least squares."""
        found = lsq_linear(self.D, self.d, (0.0, self.high), method="bvls", tol=1e-15, max_iter=2000)
        return found.x.reshape(-1, self.n)

    def split(self) -> Array:
        """The optimum (N, n) by operator splitting, polished."""
        solver = osqp.OSQP()
        H = csc_matrix(2.0 * self.D.T @ self.D)
        size = len(H.indptr) - 1
        solver.setup(H, -2.0 * self.D.T @ self.d, csc_matrix(eye(size)), np.zeros(size), np.full(size, self.high),
                     verbose=False, eps_abs=1e-9, eps_rel=1e-9, max_iter=200_000, polishing=True)  # fmt: skip
        return solver.solve(raise_error=True).x.reshape(-1, self.n)

    def slope(self, U: Array) -> Array:
        """The slope (N, n) of the cost."""
        return (2.0 * self.D.T @ (self.D @ U.reshape(-1) - self.d)).reshape(-1, self.n)


def planned(game: HvacGame, steps: int, actions: Array | None = None) -> Iterator[Any]:
    """Go with the raw readings; yields the program of each step and what the controller made of it."""
    last = None
    for k in range(steps):
        x, before = game.state.estimate[0, 0].copy(), game.state.integrator[0].copy()
        dx = np.zeros_like(x) if last is None else x - last
        program, last = Stacked(game.config, k, x, dx, before), x
        go(game, 0, None if actions is None else actions[k])
        yield program, game.state.plan[0].copy()


def tried(seed: int, **overrides: Any) -> tuple[HvacGame, Array]:
    """A game with an attack that drives the heating into both limits, and its attack."""
    actions = np.random.default_rng(seed).uniform(-1, 1, (120, 5))
    actions[:, :4] = np.repeat(actions[::10, :4], 10, axis=0)
    actions[:, 4] = 1.0
    return started([seed], controller="qp", num_compromised=4, **SMALL, **overrides), actions


def test_plans_are_the_optima_that_two_solvers_find() -> None:
    game, actions = tried(0, max_heating_w=60.0, move_weight=1e-3, **COLD)
    bound = []
    for k, (program, plan) in enumerate(planned(game, 110, actions)):
        if k % 20 == 0:
            np.testing.assert_allclose(plan, program.bounded(), atol=1e-6)
            np.testing.assert_allclose(plan, program.split(), atol=1e-4)
            bound.append([(plan == 0).mean(), (plan == 60).mean()])
    assert (np.mean(bound, axis=0) > 0.1).all()  # both limits are met
    assert np.mean(bound) < 0.45  # and not everywhere


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10**6), horizon=st.integers(1, 40), weight=st.floats(1e-4, 10.0),
    heating=st.floats(5.0, 5000.0), noise=st.floats(0.0, 2.0), cold=st.booleans(), zones=st.integers(2, 5),
)  # fmt: skip
def test_no_plan_can_be_bettered(
    seed: int, horizon: int, weight: float, heating: float, noise: float, cold: bool, zones: int
) -> None:
    """The conditions of optimality, in any building: a step down the slope, cut to the limits, leads nowhere."""
    generator = np.random.default_rng(seed)
    building = {
        "heat_capacity_j_per_k": tuple(generator.uniform(0.3e6, 0.9e6, zones)),
        "wall_resistance_k_per_w": tuple(generator.uniform(0.1, 0.4, zones)),
        "link_zones": tuple(np.ravel([(i, i + 1) for i in range(1, zones)]).tolist()),
        "link_resistance_k_per_w": tuple(generator.uniform(0.012, 0.05, zones - 1)),
        "ground_zones": (1,),
        "num_sensors": zones,
    }
    own = {"prediction_steps": horizon, "move_weight": weight, "max_heating_w": heating, "noise_std_c": noise}
    game = started([seed], controller="qp", **{**SMALL, **(COLD if cold else {}), **building, **own})
    for program, plan in planned(game, 25):
        assert (plan >= 0.0).all()
        assert (plan <= heating).all()
        led = np.clip(plan - program.slope(plan) / (2.0 * weight), 0.0, heating)
        np.testing.assert_allclose(plan, led, atol=1e-6)
        np.testing.assert_array_equal(game.state.integrator[0], plan[0])


def test_a_plan_does_not_depend_on_the_plan_before() -> None:
    game, actions = tried(3, max_heating_w=100.0, **COLD)
    for k in range(80):
        other = game.model(0, 1)
        other.state.plan[:] = np.random.default_rng(k).uniform(-50, 300, game.state.plan.shape)
        go(game, 0, actions[k])
        go(other, 0, actions[k])
        np.testing.assert_allclose(other.state.plan, game.state.plan, atol=1e-6)


def test_the_first_step_of_a_plan_is_applied() -> None:
    game, actions = tried(1, max_heating_w=100.0, **COLD)
    for k, (_, plan) in enumerate(planned(game, 40, actions)):
        np.testing.assert_array_equal(game.state.integrator[0], plan[0])
        assert k == 0 or not np.array_equal(plan[0], plan[1])


def test_without_limits_it_is_the_gains() -> None:
    """On a cold day without noise the heating never meets a limit."""
    day = {**QUIET, **COLD, "initial_c": 25.0, "num_steps": 400, "onset_step": 399, "max_heating_w": 1e5}
    clipped, free = started([0], **day), started([0], controller="qp", **day)
    A, B, G = discretise(free.config)
    kept_up = (25.0 - A @ np.full(4, 25.0) - G * weather(free.config, np.zeros(1))[0]) / B
    for game in (clipped, free):
        game.state.integrator[:] = kept_up
    for _ in range(300):
        go(clipped)
        go(free)
        assert (free.state.plan > 0).all()
        np.testing.assert_allclose(free.state.integrator, clipped.state.integrator, atol=1e-6)


@pytest.mark.parametrize(
    ("variance", "clip", "qp"),
    [(0.2, 3.78, 28.11), (0.8, 5.85, 97.81)],  # found by another implementation, with OSQP
)
def test_noise_tells_a_program_with_limits_from_one_that_is_clipped(variance: float, clip: float, qp: float) -> None:
    day = {"num_steps": 360, "onset_step": 100, "prediction_steps": 40, "noise_std_c": variance**0.5}
    for controller, expected in {"clip": clip, "qp": qp}.items():
        game = started([0], controller=controller, **day)
        go(game, num_steps=359)
        assert game.metrics()["a_impact"][0] == pytest.approx(expected, abs=0.005)


def test_no_level_beside_the_nearest_ones_is_better() -> None:
    """Where limits that hold later in the plan go on to hold, and the rest of it answers."""
    _, actions = tried(1)
    heating = {"max_heating_w": 400.0, "num_levels": 20, "move_weight": 1e-5}
    game = started([1], controller="levels", num_compromised=4, **{**SMALL, **COLD, **heating, "prediction_steps": 20})
    n, ways, compared = 4, np.vstack([np.eye(4), -np.eye(4)]) * 20.0, 0
    for k, (program, plan) in enumerate(planned(game, 110, actions)):
        applied = game.state.heating[0]
        np.testing.assert_allclose(applied, 20.0 * np.rint(plan[0] / 20.0), atol=1e-9)
        np.testing.assert_array_equal(game.state.integrator[0], applied)
        if k % 7:
            continue
        optimum = program.bounded()
        H, g = 2.0 * program.D.T @ program.D, program.slope(optimum).reshape(-1)
        free = np.flatnonzero(((optimum > 1e-9) & (optimum < 400 - 1e-9)).reshape(-1))
        free = free[free >= n]
        answer = np.linalg.solve(H[np.ix_(free, free)], H[np.ix_(free, np.arange(n))])
        Z = H[:n, :n] - H[np.ix_(np.arange(n), free)] @ answer

        def cost(q: Any, g: Any = g, Z: Any = Z) -> Any:
            return g[:n] @ q + 0.5 * q @ Z @ q

        q = applied - optimum[0]
        for way in ways:
            if (applied + way >= 0).all() and (applied + way <= 400).all():
                assert cost(q) <= cost(q + way) + 1e-9
                compared += 1
    assert compared > 50


def test_fine_levels_are_none() -> None:
    """A million levels, against the program whose heating is rounded to as many."""
    day = {**SMALL, **COLD, "num_levels": 1_000_000}
    fine, free = started([4], controller="levels", **day), started([4], controller="qp", **day)
    for _ in range(100):
        go(fine)
        go(free)
    np.testing.assert_allclose(fine.state.temperature, free.state.temperature, atol=1e-4)


@pytest.mark.parametrize("controller", ["qp", "levels"])
def test_environments_of_a_batch_plan_for_themselves(controller: str) -> None:
    day = {**SMALL, **COLD, "controller": controller, "preset": "easy"}
    batch = started((5, 6, 7), **day)
    go(batch, 3, np.full(5, 0.3), num_steps=100)
    for b, seed in enumerate((5, 6, 7)):
        alone = started((seed,), **day)
        go(alone, 3, np.full(5, 0.3), num_steps=100)
        np.testing.assert_array_equal(alone.state.temperature[0], batch.state.temperature[b])
        np.testing.assert_array_equal(seen(alone, "defender")["heating"][0], seen(batch, "defender")["heating"][b])


def test_a_clipping_controller_keeps_no_plan() -> None:
    game = started([0])
    assert game.state.plan.size == 0
