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
from cps_envs.hvac.moving_horizon import powers, set_gains
from cps_envs.hvac.sensors import membership, zones_of_sensors
from tests.hvac.games import go, started

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
