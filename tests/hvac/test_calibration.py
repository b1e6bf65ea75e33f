"""The threshold of MTD2: how it is found, what is shipped, and the command that does it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from cps_baselines.hvac.calibrated import SEEDS, calibrate, calibrated_threshold, shipped_thresholds
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import sensor_sets
from tests.agents.command_line import invoke, refusal
from tools.command import program
from tools.hvac.calibrate import SHIPPED, calibrate_mtd2, deciding

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
SHORT_DAY = ["--set", "num_steps=90", "--set", "window_steps=40", "--set", "onset_step=45"]


def run(*arguments: Sequence[str]) -> Result:
    return invoke(*arguments, program=program(calibrate_mtd2))


@pytest.mark.parametrize(("sensors", "expected"), [(4, 0.418), (8, 0.425)])
def test_the_recipe_gives_the_configuration_s_thresholds(sensors: int, expected: float) -> None:
    config = HVAC.config("paper", {"num_sensors": sensors})
    found = calibrate(config)
    assert found.seeds == tuple(range(1000, 1005))
    assert found.threshold_c2 == pytest.approx(expected, abs=0.0005)
    assert config.threshold_c2 == expected
    assert deciding(found) in sensor_sets(config)
    assert (found.rejecting_share == 0).all()


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


def test_shares_of_rejecting_steps_belong_to_the_threshold_that_is_configured() -> None:
    config = HVAC.config("paper", {"thresholds_c2": (1e-6, 1e-6)})
    assert (calibrate(config, range(2)).rejecting_share == 1).all()


@pytest.mark.parametrize("place", range(len(SHIPPED)))
def test_what_is_shipped_is_what_the_command_finds(place: int) -> None:
    level = SHIPPED[place]
    config, threshold_c2 = shipped_thresholds()[place]
    assert config == level.config
    assert calibrate(level.config).threshold_c2 == pytest.approx(threshold_c2, rel=1e-3)


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


def test_command_writes_what_it_prints(tmp_path: Path) -> None:
    target = tmp_path / "thresholds.json"
    result = run(*SHORT_DAY, "--seeds", "3", "--json", "--out", str(target))
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert json.loads(target.read_text()) == document
    assert document["seeds"] == [1000, 1001, 1002]
    (level,) = document["levels"]
    config = HVAC.config("paper", level["overrides"])
    assert level["threshold_c2"] == pytest.approx(calibrate(config, range(1000, 1003)).threshold_c2, abs=1e-6)
    assert level["configured_c2"] == 0.418
    assert len(level["rejecting_share"]) == 3


def test_command_prints_a_table() -> None:
    result = run("--preset", "easy", "--seeds", "1")
    assert result.exit_code == 0, result.output
    assert "eps of MTD2 from 1 attack-free days" in result.stdout
    assert "easy" in result.stdout


@pytest.mark.parametrize("wrong", [("--set", "windows=3"), ("--preset", "papr"), ("--set", "num_sensors=5")])
def test_wrong_input_gets_one_message(wrong: tuple[str, ...]) -> None:
    assert "Error" in refusal("--seeds", "1", *wrong, program=program(calibrate_mtd2))
