"""What the attacks of chapter 4 cost the building under its defences, beside the specification's values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import sensor_sets
from tests import episodes
from tests.hvac.games import play


def impacts(attacker: str, defender: str, **overrides: Any) -> list[float]:
    """Mean A_impact over ten days with 1, 2, 3 and 4 of the four sensors compromised."""
    return [play(attacker, defender, num_compromised=size, **overrides)["a_impact"].mean() for size in (1, 2, 3, 4)]


# What attacks cost under the paper's defences. The standard error of ten days under MTD1 is 7 to 10 percent.


@pytest.mark.parametrize(
    ("attack", "expected"),
    [
        ("constant", [2.1, 34, 308, 2395]),
        ("sine", [1.3, 22, 288, 2297]),
        ("random", [1.3, 11, 240, 2075]),
    ],
)
def test_mtd1_stands_one_attacked_sensor_but_not_two(attack: str, expected: list[float]) -> None:
    assert impacts(attack, "mtd1") == pytest.approx(expected, rel=0.25)


@pytest.mark.parametrize(("attack", "all_four"), [("constant", 1432), ("sine", 1511), ("random", 1511)])
def test_mtd2_fails_only_when_all_sensors_are_attacked(attack: str, all_four: int) -> None:
    *some, everything = (play(attack, "mtd2", num_compromised=size) for size in (1, 2, 3, 4))
    for outcome in some:
        assert outcome["a_impact"].mean() == pytest.approx(1.2, rel=0.05)
        assert outcome["flawed_steps"].mean() < 0.02 * 520
    assert everything["a_impact"].mean() == pytest.approx(all_four, rel=0.15)


@pytest.mark.parametrize("attack", ["constant", "sine", "random"])
def test_mtd2_that_falls_back_to_the_model_does_not_fail_at_all(attack: str) -> None:
    outcome = play(attack, "mtd2?fallback=model", num_compromised=4)
    assert outcome["a_impact"].mean() == pytest.approx(1.17, rel=0.05)
    assert (outcome["model_steps"] == outcome["rejecting_steps"]).all()
    assert outcome["model_steps"].mean() > 500


@pytest.mark.parametrize(
    ("attack", "expected"),
    [
        ("sine", [164, 798, 2163, 6242]),
        ("random", [190, 837, 2250, 6318]),
    ],
)
def test_scripted_attacks_without_defence(attack: str, expected: list[int]) -> None:
    assert impacts(attack, "none") == pytest.approx(expected, rel=0.03)


def test_mtd2_uses_fewer_sets_the_more_sensors_are_attacked() -> None:
    used = [play("random", "mtd2", num_compromised=size)["distinct_sets"].mean() for size in (1, 2, 3, 4)]
    assert used == pytest.approx([7.0, 3.1, 1.3, 3.2], abs=0.5)
    everything = play("random", "mtd1", num_compromised=2)["distinct_sets"].mean()
    assert 13 <= everything <= 14


# Stealthy attacks are what MTD2 does not stand.


@pytest.mark.parametrize(
    ("attack", "defender", "expected"),
    [
        ("root_ramp", "mtd1", [8.8, 176, 501, 736]),
        ("ramp", "mtd2", [6.3, 43, 125, 773]),
        ("ramp?rate_c_per_h=0.5&keep_noise=true", "mtd2", [3.6, 19, 55, 104]),
    ],
)
def test_ramps_gain_what_the_specification_says(attack: str, defender: str, expected: list[float]) -> None:
    assert impacts(attack, defender) == pytest.approx(expected, rel=0.3)


@pytest.mark.parametrize("defender", ["mtd1", "mtd2"])
def test_the_mimic_gains_what_the_specification_says(defender: str) -> None:
    _, two, three, _ = impacts("mimic", defender)
    assert 20 < two < 26
    assert 57 < three < 70


@pytest.mark.parametrize(
    ("attack", "stealthy"),
    [("ramp?rate_c_per_h=0.5", True), ("mimic", True), ("ramp?rate_c_per_h=1.5", False), ("constant", False)],
)
def test_stealthy_attacks_keep_the_sets_of_single_forged_sensors_below_eps(attack: str, stealthy: bool) -> None:
    """Mean over ten days of Jm_a. Forged sensors together are not consistent: each tells of another building."""
    config = HVAC.config("paper", {"num_compromised": 3})
    singles = [sensor_sets(config).index((sensor,)) for sensor in (1, 2, 4)]
    means = episodes.watched(
        HVAC, lambda game: game.mean_residuals()[:, singles].mean(axis=0), attack, "mtd2", range(10), num_compromised=3
    )
    assert (np.array(means[220:]) < config.threshold_c2).all() == stealthy


def test_slower_and_faster_ramps_gain_less() -> None:
    """The optimum is an edge: beyond it the mean residuals cross eps."""
    gained = [
        play(f"ramp?rate_c_per_h={rate}", "mtd2", num_compromised=3)["a_impact"].mean() for rate in (0.3, 0.5, 0.7, 1.0)
    ]
    assert gained[0] < gained[1] < gained[2]
    assert gained[3] < 3
