"""The attack that keeps each forged sensor's own set passing, and no more than that."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cps_envs.core.play import play_episodes
from cps_envs.core.types import Array
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import sensor_sets

DAYS = range(6)


def outcome(attacker: str, count: int, on_step: Callable[..., Any] | None = None) -> dict[str, Array]:
    config = HVAC.config("paper", {"num_compromised": count})
    return play_episodes(HVAC, config, {"attacker": attacker, "defender": "mtd2"}, DAYS, on_step=on_step)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_it_gains_more_than_the_ramp_on_the_same_days(count: int) -> None:
    brink, ramp = (outcome(attacker, count)["a_impact"] for attacker in ("brink", "ramp"))
    assert (brink - ramp).mean() > 0.03 * ramp.mean()


def test_mean_residuals_stay_just_below_the_threshold() -> None:
    config = HVAC.config("paper", {"num_compromised": 3})
    alone = [sensor_sets(config).index((sensor,)) for sensor in (1, 2, 4)]
    late = []

    def note(game: HvacGame) -> None:
        if game.elapsed[0] >= 300:
            late.append(game.mean_residuals()[:, alone])

    outcome("brink?margin_c2=0.02", 3, note)
    assert np.mean(np.array(late) <= config.threshold_c2) > 0.99
    assert np.mean(late) == pytest.approx(config.threshold_c2 - 0.02, abs=0.01)


def test_it_leaves_other_sensors_and_the_time_before_the_onset_alone() -> None:
    config = HVAC.config("paper", {"num_compromised": 1})
    touched = []

    def note(game: HvacGame) -> None:
        state = game.state
        touched.append(state.reading != state.measured)

    outcome("brink", 1, note)
    forged = np.array(touched)
    assert not forged[: config.onset_step].any()
    assert not forged[:, :, [0, 2, 3]].any()
    assert forged[config.onset_step + 1 :, :, 1].all()
