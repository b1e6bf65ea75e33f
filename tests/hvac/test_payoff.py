"""What is measured and paid, added up by plain NumPy from a record of short episodes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.types import Array
from cps_envs.hvac.game import HvacGame
from tests.hvac.games import SHORT, go, started

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
COMFORT_C, KWH, HOUR = 0.6, 3.6e6, 3600.0


def recorded(game: HvacGame, choices: Array, seed: int) -> dict[str, Array]:
    """The states x(0) to x(K), the heating u(0) to u(K - 1), the payoffs, and the mean residuals before each choice."""
    rng = np.random.default_rng(seed)
    size = game.action_space["attacker"].shape[0]
    log: dict[str, list[Array]] = {"x": [game.state.temperature[0].copy()], "u": [], "paid": [], "rejects": []}
    for choice in choices:
        log["rejects"].append((game.mean_residuals()[0] > game.config.threshold_c2).all())
        log["paid"].append(go(game, int(choice), rng.uniform(-1, 0, size))[0])
        log["x"].append(game.state.temperature[0].copy())
        log["u"].append(game.state.heating[0].copy())
    return {name: np.array(values) for name, values in log.items()}


def counted(game: HvacGame, choices: Array, rejects: Array) -> dict[str, float]:
    """What the choices count, of all but those before the window is full."""
    sets, filters = game.constants.member, game.constants.filter_member
    uses = np.vstack([np.zeros(sets.shape[1], bool), sets, np.zeros(sets.shape[1], bool), filters])
    late = np.arange(len(choices)) >= game.config.window_steps
    believed = uses[choices].any(axis=1) & late
    flawed = believed & (uses[choices] & game.state.compromised[0]).any(axis=1)
    return {
        "distinct_sets": len(set(choices[believed].tolist())),
        "flawed_steps": (flawed & (np.arange(len(choices)) >= game.state.onset[0])).sum(),
        "model_steps": (late & ~believed & (choices > 0)).sum(),
        "rejecting_steps": (late & rejects).sum(),
    }


@pytest.mark.parametrize("payoff", ["impact", "discomfort", "energy"])
@pytest.mark.parametrize("onset", [0, 45])
def test_errors_and_heating_are_summed_and_one_of_them_is_paid(payoff: str, onset: int) -> None:
    setting = SHORT | {"onset_step": onset, "num_compromised": 2, "comfort_c": COMFORT_C, "payoff": payoff}
    game = started([4], **setting)
    log = recorded(game, np.full(89, 3), 1)
    error, step_s = np.abs(log["x"] - game.config.reference_c), game.config.step_s
    squares = (error[onset:] ** 2).sum(axis=0) / len(error[onset:])
    outside = error[onset:] > COMFORT_C
    expected = {
        "a_impact": squares.sum(),
        "worst_zone_impact": squares.max(),
        "mean_abs_error_c": error.mean(),
        "energy_kwh": log["u"].sum() * step_s / KWH,
        "attack_kwh": log["u"][onset:].sum() * step_s / KWH,
        "discomfort_h": outside.sum() * step_s / HOUR,
    }
    assert outside.any(axis=0).any()
    assert not outside.all()
    assert log["u"][onset:].sum() > 0
    metrics = {name: game.metrics()[name][0] for name in expected}
    assert metrics == pytest.approx(expected, rel=1e-9)
    paid = {"impact": "a_impact", "discomfort": "discomfort_h", "energy": "attack_kwh"}[payoff]
    assert log["paid"].sum() == pytest.approx(expected[paid], rel=1e-9)
    if onset > 0:
        assert (log["paid"][: onset - 1] == 0).all()


@pytest.mark.parametrize("filters", [False, True])
@pytest.mark.parametrize("onset", [45, 60])
def test_choices_are_counted_by_the_sensors_that_they_believe(filters: bool, onset: int) -> None:
    game = started([4], **SHORT | {"onset_step": onset}, num_compromised=1, kalman_filters=filters, noise_std_c=0.5)
    size = int(game.action_space["defender"].n)
    model = len(game.constants.member) + 1
    choices = np.random.default_rng(6).integers(0, size, 89)
    choices[50:56] = [0, 1, model - 1, model, size - 1, 0]  # the readings, the model, and what is next to them
    log = recorded(game, choices, 2)
    expected = counted(game, choices, log["rejects"])
    assert {name: game.metrics()[name][0] for name in expected} == expected
    assert 0 < expected["flawed_steps"] < 89 - onset
    assert expected["model_steps"] > 0


def test_a_set_passes_whose_mean_residual_is_at_most_the_threshold() -> None:
    """Each step with a full window counts in which no set passes; forged sensors make the sets that hold them fail."""
    for compromised, some in ((0, False), (4, True)):
        game = started([4], **SHORT | {"onset_step": 40}, num_compromised=max(compromised, 1))
        game.state.compromised[0] = compromised > 0
        rejects = recorded(game, np.zeros(89, np.int64), 3)["rejects"]
        assert game.metrics()["rejecting_steps"][0] == rejects[40:].sum()
        assert rejects[40:].any() == some


def test_a_mean_residual_at_the_threshold_passes() -> None:
    counts: list[Any] = []
    for factor in (1.0, 1.0 + 1e-9):
        game = started([4], **SHORT)
        go(game, num_steps=50)
        before = game.metrics()["rejecting_steps"][0]
        game.state.mean_residual[0] = game.config.threshold_c2 * factor
        go(game)
        counts.append(game.metrics()["rejecting_steps"][0] - before)
    assert counts == [0, 1]
