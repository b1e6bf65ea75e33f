"""The optimal stealthy attack on MTD2: its matrices against the game, and its bound against what can be checked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.problem import HVAC
from tests.hvac.games import go, started
from tools.hvac.played import OpenLoop, impact_played
from tools.hvac.program import (
    Quadratic,
    Response,
    certified,
    closed_loop,
    hats,
    quadratic,
    respond,
    solve,
)

SHORT = {"num_steps": 220, "window_steps": 60, "onset_step": 70, "thresholds_c2": (0.9, 0.9)}

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows


def short(**overrides: Any) -> HvacConfig:
    return HVAC.config("paper", {**SHORT, "num_compromised": 2, **overrides})


def attack_of(response: Response, seed: int = 0, size: float = 3.0) -> Array:
    return size * np.random.default_rng(seed).uniform(0, 1, response.shift.shape[1])


def test_biases_are_linear_between_knots_from_the_onset_on() -> None:
    course = hats(100, 20, 30)
    assert course.shape == (100, 4)  # knots at 20, 50, 80 and 99
    assert (course[:20] == 0).all()
    np.testing.assert_allclose(course[20:].sum(axis=1), 1.0)
    assert course[[20, 50, 80, 99]].tolist() == np.eye(4).tolist()
    assert course[35].tolist() == [0.5, 0.5, 0, 0]


def test_residuals_of_forged_sets_are_those_of_the_game() -> None:
    """Without noise the sum of J of a forged sensor's own set is the quadratic form, step by step."""
    config = short(noise_std_c=0.0)
    response = respond(config, 30)
    b = attack_of(response)
    game = started([0], **{**SHORT, "num_compromised": 2, "noise_std_c": 0.0})
    bias = np.zeros((220, 4))
    bias[:, [1, 0]] = response.biases(b)  # sensors 2 and 1 fall first
    total = np.zeros(2)
    for k in range(219):
        if k >= 60:
            total += game.state.residual[0, [3, 7]]  # of the sets {2} and {1}
            predicted = [part @ gram[k - 60] @ part for part, gram in zip(b.reshape(2, -1), response.gram, strict=True)]
            np.testing.assert_allclose(total, predicted, rtol=2e-3, atol=1e-6)  # set {1} amplifies rounding
        action = np.append(-bias[k + 1] / 15.0, -1.0)
        go(game, 2, action)  # set {3}


def test_the_room_is_what_the_noise_leaves() -> None:
    """Over many days without a bias, the mean residual of a noise-free reading is the noise of the window."""
    config = short()
    response = respond(config, 30)
    game = started(range(300), **SHORT, num_compromised=2)
    for k in range(150):
        if k == 149:
            found = game.state.residual_sum[:, 3].mean() - game.state.residual[:, 3].mean()
        go(game, 2, np.array([0.0, 0.0, 0.0, 0.0, -1.0]))
    noise = config.threshold_c2 * (148 - 60 + 1) - response.room[0, 148 - 60]
    assert found == pytest.approx(noise, rel=0.1)


def test_the_controller_answers_linearly() -> None:
    """A constant error of the estimate moves the zones as a game does in which the heating stays within its limits."""
    config = HVAC.config("paper", {"ground_c": 10.0, "outdoor_mean_c": 5.0, "outdoor_swing_c": 0.0, "num_levels": 10**6,
                                   "noise_std_c": 0.0, "max_heating_w": 1e5, "num_steps": 400})  # fmt: skip
    colder = np.zeros((400, 4, 1))
    colder[250:, :, 0] = 0.5
    predicted = closed_loop(config, colder)[:, :, 0]
    names = ("ground_c", "outdoor_mean_c", "outdoor_swing_c", "num_levels", "noise_std_c", "max_heating_w", "num_steps")
    same = {name: getattr(config, name) for name in names}
    games = [started([0], **same, num_compromised=4, onset_step=onset) for onset in (250, 399)]
    for k in range(399):
        for game in games:
            go(game, 0, np.array([-0.5 / 15.0] * 4 + [-1.0]))
        lied, plain = (game.state.temperature[0] for game in games)
        np.testing.assert_allclose(lied - plain, predicted[k + 1], atol=2e-4)


def test_multipliers_certify_whatever_they_are() -> None:
    generator = np.random.default_rng(0)
    factors = generator.standard_normal((5, 3, 3))
    forms = factors @ factors.transpose(0, 2, 1)
    half = generator.standard_normal((4, 4))
    problem = Quadratic(half.T @ half, forms)
    z = generator.standard_normal((20_000, 3))
    z /= np.sqrt(np.einsum("ni,kij,nj->nk", z, forms, z).max(axis=1, keepdims=True))  # on the boundary
    lifted = np.c_[z, np.ones(len(z))]
    reached = np.einsum("ni,ij,nj->n", lifted, problem.objective, lifted).max()
    for multipliers in (np.ones(5), generator.uniform(0, 3, 5), np.array([1.0, 0, 0, 0, 0])):
        assert certified(problem, multipliers) >= reached
    assert certified(problem, np.zeros(5)) == np.inf


@pytest.mark.parametrize(
    "overrides",
    [{"onset_step": (70, 80)}, {"num_compromised": (1, 2)}, {"random_compromise": True}, {"model_error": 0.01},
     {"heat_drift_w": 10.0}],
)  # fmt: skip
def test_attacks_that_are_drawn_are_refused(overrides: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match="certain"):
        respond(short(**overrides))


def test_the_optimum_keeps_within_the_room_and_meets_its_bound() -> None:
    pytest.importorskip("cvxpy")
    response = respond(short(), 30)
    found = solve(response)
    parts = found.b.reshape(2, -1)
    used = np.einsum("mi,mkij,mj->mk", parts, response.gram, parts) / response.room
    assert used.max() <= 1 + 1e-6
    assert used.max() > 0.999
    assert found.impact_c2 <= found.bound_c2 <= 1.05 * found.impact_c2
    assert found.bound_c2 >= max(response.impact(_scaled(response, seed)) for seed in range(200))
    assert quadratic(response).objective[-1, -1] == pytest.approx(response.impact(np.zeros_like(found.b)))


def _scaled(response: Response, seed: int) -> Array:
    """A random attack, as large as the room allows."""
    b = attack_of(response, seed, size=1.0)
    parts = b.reshape(2, -1)
    used = np.einsum("mi,mkij,mj->mk", parts, response.gram, parts) / response.room
    return b / np.sqrt(used.max())


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 3])
def test_played_in_preset_paper_it_comes_near_what_the_mean_field_says(count: int) -> None:
    pytest.importorskip("cvxpy")
    config = HVAC.config("paper", {"num_compromised": count})
    response = respond(config)
    found = solve(response)
    assert found.bound_c2 <= 1.001 * found.impact_c2
    played = impact_played(config, OpenLoop(config, response.sensors, 0.98 * response.biases(found.b)), 20)
    assert 0.85 * found.impact_c2 < played < 1.02 * found.bound_c2
