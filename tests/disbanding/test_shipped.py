"""The networks that learned this problem from reward alone: that they play, and are better than who learned nothing."""

from __future__ import annotations

from functools import cache

import pytest

from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.problem import DISBANDING

EPISODES = 12
PLAIN = "always?adapter=follow&action=[" + ",".join(["0"] * 22) + "]"  # the follower that the defence begins as


@cache
def paid(attacker: str, defender: str) -> FloatArray:
    players = {"attacker": attacker, "defender": defender}
    found: FloatArray = play_episodes(DISBANDING, DISBANDING.config("learning", {}), players, range(EPISODES))["return"]
    return found


@pytest.mark.slow
def test_the_defence_is_better_than_none_and_the_follower_that_it_began_as() -> None:
    shipped = paid("timed?jam=1", "zoo:disbanding-defense")
    for other in ("none", PLAIN):
        gain = paid("timed?jam=1", other) - shipped
        assert gain.mean() > 0.5, other


@pytest.mark.slow
@pytest.mark.parametrize("other", ["none", "random", "lead"])
def test_the_attack_is_better_than_who_learned_nothing(other: str) -> None:
    usual = "string?detection_mps=0"
    gain = paid("zoo:disbanding-attack", usual) - paid(other, usual)
    assert gain.mean() > 3
