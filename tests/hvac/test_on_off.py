"""The thermostats that model predictive control is compared with."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.hvac.games import QUIET, SHORT, go, started


def powers(num_steps: int, **config: Any) -> tuple[Any, Any]:
    """What each zone is heated with, (num_steps, n) W, and the temperatures (num_steps, n) that decided it, C."""
    game, heating, seen = started(controller="on_off", **{**SHORT, **config}), [], []
    for _ in range(num_steps):
        seen.append(game.state.reading[0].copy())
        go(game)
        heating.append(game.state.heating[0].copy())
    return np.array(heating), np.array(seen)


def test_each_zone_is_heated_with_all_or_nothing_by_its_band() -> None:
    heating, seen = powers(89, outdoor_mean_c=10.0, ground_c=10.0, hysteresis_c=0.3, max_heating_w=(1e3, 2e3, 1e3, 3e3))
    expected, before = [], np.zeros(4)
    for reading in seen:
        before = np.where(reading < 24.7, [1e3, 2e3, 1e3, 3e3], np.where(reading > 25.3, 0.0, before))
        expected.append(before)
    np.testing.assert_array_equal(heating, expected)
    assert ((np.diff(heating, axis=0) != 0).sum(axis=0) >= 4).all()


def test_a_plant_that_cools_stops_at_the_set_point() -> None:
    heating, seen = powers(89, **QUIET, outdoor_mean_c=38.0, ground_c=34.0, initial_c=27.0, min_heating_w=-1500.0)
    before, stopped = np.zeros(4), 0
    for reading, power in zip(seen, heating, strict=True):
        passed = before * (reading - 25.0) > 0
        within = np.where(passed, 0.0, before)
        before = np.where(reading < 24.5, 1000.0, np.where(reading > 25.5, -1500.0, within))
        stopped += (passed & (before == 0.0)).sum()
        np.testing.assert_array_equal(power, before)
    assert stopped > 4


def test_thermostats_that_believe_a_liar_overheat_at_once() -> None:
    day = {**QUIET, "num_steps": 400, "num_compromised": 1, "attack_order": (1,)}
    forged = [-0.2, 0.0, 0.0, 0.0, 1.0]  # 22 C
    worst = {}
    for controller in ("clip", "on_off"):
        game = started(controller=controller, **day)
        go(game, attack=forged, num_steps=260)
        worst[controller] = game.state.temperature[0].max()
    assert worst["on_off"] > worst["clip"] + 5.0


@pytest.mark.parametrize("field", ["prediction_steps", "move_weight"])
def test_the_program_has_no_say(field: str) -> None:
    one, _ = powers(60)
    other, _ = powers(60, **{field: 3})
    np.testing.assert_array_equal(one, other)
