"""Comparing a result with that of a refined configuration."""

from __future__ import annotations

import pytest

from cps_envs.core.conformance import Refinement, check_refinement, refine
from cps_envs.core.play import play_episodes
from tests.core.toy import TOY

IDLE = {"attacker": "cps_envs.core.policy:Idle", "defender": "cps_envs.core.policy:Idle"}


def test_both_means_are_over_the_same_seeds() -> None:
    found = refine(TOY, IDLE, {"drift": 0.5}, seeds=(3, 4), duration_s=6.0)
    for value, overrides in ((found.coarse, {"duration_s": 6.0}), (found.fine, {"duration_s": 6.0, "drift": 0.5})):
        expected = play_episodes(TOY, TOY.config("paper", overrides), IDLE, (3, 4))["return"].mean()
        assert value == expected
    assert found.coarse != found.fine


def test_a_change_is_relative_to_the_coarse_result_and_to_no_less_than_the_floor() -> None:
    assert Refinement(10.0, 12.0, 1.0).change == pytest.approx(0.2)
    assert Refinement(-10.0, -12.0, 1.0).change == pytest.approx(0.2)
    assert Refinement(0.0, 0.05, 1.0).change == pytest.approx(0.05)


def test_too_large_a_change_is_refused_with_both_results() -> None:
    assert check_refinement(TOY, IDLE, {}, tolerance=0.0).change == 0.0
    with pytest.raises(AssertionError, match=r"toy.*drift.*becomes"):
        check_refinement(TOY, IDLE, {"drift": 0.5}, tolerance=0.001)
