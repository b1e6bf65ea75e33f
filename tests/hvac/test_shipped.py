"""Shipped networks of our own PPO play, and are worth more than doing nothing and than constants of their adapter."""

from __future__ import annotations

import pytest

from cps_envs.hvac.expected import LEVELS
from tests.hvac.games import play


def test_the_attack_pays_where_three_sensors_lie() -> None:
    liars = {"compromised_weights": (0, 0, 0, 1)}

    def paid(attacker: str) -> float:
        return float(play(attacker, "largest", range(24), "learning", **liars)["return"].mean())

    network, constant = paid("zoo:hvac-attack"), paid(f"always?adapter=together&action={LEVELS.index(-0.4)}")
    assert network > 10 * paid("none")
    assert network > constant


@pytest.mark.slow
def test_the_defence_is_worth_more_than_doing_nothing_and_than_fixed_sensors() -> None:
    def paid(defender: str) -> float:
        return float(play("mimic", defender, range(24), "learning")["return"].mean())

    network = paid("zoo:hvac-defense")
    assert network < paid("none")
    assert network < paid("fixed")
