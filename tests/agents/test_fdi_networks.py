"""The shipped networks of false data: better than doing nothing and than constants, against opponents never met."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs.fdi.problem import FDI
from tests.fdi.episodes import play, spec_of
from tools.challenge.constants.adapters import constants_of

EPISODES = range(120)
MANY = range(500_000, 500_300)  # the best constants are 10 % behind


def paid(attacker: str, defender: str, episodes: range = EPISODES) -> float:
    """What the attacker is paid, the mean over episodes."""
    return float(np.mean(play(attacker, defender, episodes, "learning")["return"]))


@pytest.mark.parametrize("attacker", ["tracker", "mimic?acceleration_mps2=0.4", "mimic?acceleration_mps2=0.6"])
def test_the_defence_lets_little_pass(attacker: str) -> None:
    learned = paid(attacker, "zoo:fdi-defense")
    others = ("none", "always?adapter=sensor&action=[1,1,2]", "always?adapter=sensor&action=[1,0,0]", "bank")
    assert learned < 0.8 * min(paid(attacker, other) for other in others)


def test_the_defence_is_calm_where_nobody_attacks() -> None:
    outcome = play("none", "zoo:fdi-defense", EPISODES, "learning")
    assert outcome["false_alarm"].mean() < 0.1
    assert outcome["collided_pairs"].max() == 0


@pytest.mark.slow
@pytest.mark.parametrize("defender", ["cusum", "bank"])
def test_the_attack_is_paid_more_than_constants(defender: str) -> None:
    constants = constants_of(spec_of("attacker", preset="learning"), FDI.training["attacker"].adapter)
    assert len(constants) > 5
    others = ("none", *constants)
    assert paid("zoo:fdi-attack", defender, MANY) > max(paid(other, defender, MANY) for other in others)
