"""The shipped networks of false data: better than doing nothing and than constants, against opponents never met."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fdi.episodes import play

EPISODES = range(120)


def paid(attacker: str, defender: str) -> float:
    """What the attacker is paid, the mean over episodes."""
    return float(np.mean(play(attacker, defender, EPISODES, "learning")["return"]))


@pytest.mark.parametrize("attacker", ["tracker", "mimic?acceleration_mps2=0.4", "mimic?acceleration_mps2=0.6"])
def test_the_defence_lets_little_pass(attacker: str) -> None:
    learned = paid(attacker, "zoo:fdi-defense")
    others = ("none", "always?adapter=sensor&action=[1,1,2]", "always?adapter=sensor&action=[1,0,0]", "bank")
    assert learned < 0.8 * min(paid(attacker, other) for other in others)


def test_the_defence_is_calm_where_nobody_attacks() -> None:
    outcome = play("none", "zoo:fdi-defense", EPISODES, "learning")
    assert outcome["false_alarm"].mean() < 0.1
    assert outcome["collided_pairs"].max() == 0


@pytest.mark.parametrize("defender", ["cusum", "bank"])
def test_the_attack_is_paid_more_than_constants(defender: str) -> None:
    others = ("none", "mimic?acceleration_mps2=0.25")
    assert paid("zoo:fdi-attack", defender) > max(paid(other, defender) for other in others)
