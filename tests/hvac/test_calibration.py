"""The threshold of MTD2: how it is found, and what is shipped."""

from __future__ import annotations

import numpy as np
import pytest

from cps_baselines.hvac.calibrated import SEEDS, calibrate, calibrated_threshold, shipped_thresholds
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.problem import HVAC

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows


@pytest.mark.parametrize(("sensors", "expected"), [(4, 0.418), (8, 0.425)])
def test_the_recipe_gives_the_configuration_s_thresholds(sensors: int, expected: float) -> None:
    config = HVAC.config("paper", {"num_sensors": sensors})
    found = calibrate(config)
    assert found.threshold_c2 == pytest.approx(expected, abs=0.0005)
    assert config.threshold_c2 == expected


def test_it_is_the_largest_mean_residual_from_the_twentieth_sample_on() -> None:
    config = HVAC.config("paper", {"num_steps": 90, "window_steps": 40, "onset_step": 45})
    means = []
    players = {"attacker": "none", "defender": "mtd1"}
    play_episodes(HVAC, config, players, SEEDS, on_step=lambda game: means.append(game.mean_residuals()))
    found = calibrate(config)
    assert found.largest_c2 == pytest.approx(np.max(means[60:], axis=0))
    assert found.threshold_c2 == 1.2 * found.largest_c2.max()
    assert np.max(means[:60]) > found.largest_c2.max()


def test_a_plant_that_differs_from_the_model_needs_a_higher_threshold() -> None:
    plain, off = (calibrate(HVAC.config("paper", {"model_error": error})).threshold_c2 for error in (0.0, 0.05))
    assert off > 2 * plain


@pytest.mark.parametrize(("config", "threshold_c2"), shipped_thresholds())
def test_what_is_shipped_is_found_again(config: HvacConfig, threshold_c2: float) -> None:
    assert calibrate(config).threshold_c2 == pytest.approx(threshold_c2, rel=1e-3)


def test_thresholds_are_found_by_what_they_depend_on() -> None:
    paper = calibrated_threshold(HVAC.config("paper", {}))
    attacked = {"onset_step": 300, "num_compromised": 4, "num_steps": 400, "attacker_view": "grey"}
    assert calibrated_threshold(HVAC.config("paper", attacked)) == paper
    learning = calibrated_threshold(HVAC.config("easy", {}))
    assert learning == calibrated_threshold(HVAC.config("paper", {"model_error": 0.02, "unmeasured_heat_w": 50.0}))
    assert learning > paper
    for change in ({"window_steps": 100}, {"noise_std_c": 0.3}, {"model_error": 0.01}):
        with pytest.raises(ConfigurationError, match="calibrate"):
            calibrated_threshold(HVAC.config("paper", change))


def test_the_calibrated_policy_uses_it() -> None:
    spec = HVAC.game(HVAC.config("easy", {}), 1).spec("defender")
    policy = resolve_policy("mtd2_calibrated?fallback=model", spec)
    assert policy.threshold_c2 == calibrated_threshold(spec.config)
    config = HVAC.config("easy", {"model_error": 0.05, "unmeasured_heat_w": 100.0})
    shares = {
        name: play_episodes(HVAC, config, {"attacker": "none", "defender": name}, range(10))["distinct_sets"].mean()
        for name in ("mtd2", "mtd2_calibrated")
    }
    assert shares["mtd2_calibrated"] > shares["mtd2"]
