"""Sums over the window at a cost that does not grow with it, against sums of the samples themselves."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from cps_envs.hvac.building import discretise, modes
from cps_envs.hvac.config import PAPER
from cps_envs.hvac.houses import house
from cps_envs.hvac.model import CHUNK
from cps_envs.hvac.moving_horizon import MAX_CONDITION, observability, powers, set_gains
from cps_envs.hvac.sensors import membership, zones_of_sensors
from tests.hvac.games import go, started
from tools.hvac.observer import distance_c

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
ALIKE: dict[str, Any] = {
    "heat_capacity_j_per_k": (0.5e6,) * 4,
    "wall_resistance_k_per_w": (0.12,) * 4,
    "link_resistance_k_per_w": (0.016,) * 4,
}


@pytest.mark.parametrize("building", [{}, ALIKE, house(9)])
def test_modes_are_those_of_the_building(building: dict[str, Any]) -> None:
    """Also where zones are alike, and eigenvalues equal."""
    config = dataclasses.replace(PAPER, **building)
    eigenvalues, V = modes(config)
    np.testing.assert_allclose(V * eigenvalues @ np.linalg.inv(V), discretise(config).A, atol=1e-13)
    scaled = V * np.sqrt(np.array(config.heat_capacity_j_per_k))[:, np.newaxis]
    np.testing.assert_allclose(scaled.T @ scaled, np.eye(config.num_zones), atol=1e-13)


@pytest.mark.parametrize("window", [40, 3 * CHUNK, 3 * CHUNK + 1])
def test_estimates_are_those_of_the_samples_in_the_window(window: int) -> None:
    """At every step of several blocks; window and episode need not be whole numbers of chunks or blocks."""
    game = started([0, 1], num_sensors=8, window_steps=window, onset_step=60, num_steps=5 * window + 7)
    config = game.config
    steps, zone = powers(discretise(config).A, window), zones_of_sensors(config)
    member = membership(config)
    gain, condition = set_gains(steps[1], window, member, zone)
    sure = condition < 1e3
    for k in range(config.num_steps):
        if k >= window:
            samples = game.state.series[:, k - window : k]  # (B, N_e, S)
            sums = np.einsum("tsj,bts->bsj", steps[:window][:, zone], samples)
            found = game.state.forced[:, np.newaxis] + np.einsum("aij,as,bsj->bai", gain, member, sums)
            shown = game.state.estimate[:, 1 : 1 + len(member)]
            np.testing.assert_allclose(shown[:, sure], found[:, sure], atol=1e-8, err_msg=f"k = {k}")
        if k < config.num_steps - 1:
            go(game, k % 10, [0.3, -0.2, 0.4, 0.1] * 2 + [0.0])


@pytest.mark.parametrize(("window", "building"), [(10, {}), (20, {}), (40, {}), (55, {}), (40, ALIKE), (200, ALIKE)])
def test_sets_that_hardly_observe_lose_no_digits(window: int, building: dict[str, Any]) -> None:
    """The sums square a condition of up to 3e6 here; every set keeps to the pseudo-inverse of its window."""
    steps = max(2 * window, 80) + 20
    game = started([0], window_steps=window, onset_step=60, num_steps=steps, **building)
    config = game.config
    A_powers, zone = powers(discretise(config).A, window), zones_of_sensors(config)
    member = membership(config)
    assert set_gains(A_powers[1], window, member, zone)[1].max() > MAX_CONDITION / 2
    inverses = [A_powers[window] @ np.linalg.pinv(observability(A_powers[:window], row, zone)) for row in member]
    for k in range(steps - 1):
        go(game, 0, [0.3, -0.2, 0.4, 0.1, 0.0])
        if k + 1 >= window:
            samples = game.state.series[0, k + 1 - window : k + 1]
            for a, (row, inverse) in enumerate(zip(member, inverses, strict=True)):
                found = game.state.forced[0] + inverse @ samples[:, row].ravel()
                assert np.abs(game.state.estimate[0, 1 + a] - found).max() < 1e-5, (k, a)


def test_estimates_keep_to_the_pseudo_inverse_as_documented() -> None:
    worst, condition = distance_c({})
    assert worst < 1e-7  # 9.2e-9 as it is
    assert condition == pytest.approx(3.2e3, rel=0.02)
