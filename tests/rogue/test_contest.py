"""Preset `learning`: who plays, and what there is to win, on seeds that no search has used."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import Array
from cps_envs.rogue.panels import RIVALS
from cps_envs.rogue.problem import ROGUE
from tools.challenge.constants.rogue import CONSTANTS, constant

SEEDS = range(97_000, 97_048)
ROUGH = ("square?frequency_hz=0.05", "duty_square", "contested?against=pd")  # attackers that a constant is screened by


@cache
def payoff(attacker: str, defender: str, first: int = SEEDS[0], count: int = len(SEEDS)) -> Array:
    players = {"attacker": attacker, "defender": defender}
    return play_episodes(ROGUE, ROGUE.config("learning", {}), players, range(first, first + count))["return"]


def score(
    defender: str,
    attackers: tuple[str, ...] = tuple(contestant.reference for contestant in RIVALS["attacker"]),
    **seeds: Any,
) -> Array:
    return np.mean([payoff(attacker, defender, **seeds) for attacker in attackers], axis=0)


def test_a_constant_gives_each_class_of_places_its_law() -> None:
    assert json.loads(constant((1, 0, 3)).partition("=")[2])[::2] == [1, 1, 0, 0, 3, 3, 3, 3]
    assert len(set(CONSTANTS["defender"])) == len(CONSTANTS["defender"]) > 100


@pytest.mark.slow
def test_no_constant_is_as_good_as_the_monitor() -> None:
    """All of the declaration are screened, and the five best of them judged against every attacker."""
    screened = {each: score(each, ROUGH, first=96_000, count=6).mean() for each in CONSTANTS["defender"]}
    monitor = score("monitor")
    for each in sorted(screened, key=screened.__getitem__)[:5]:
        assert np.mean(score(each) - monitor) > 0.5, each


@pytest.mark.slow
def test_something_is_left_to_infer_and_something_can_be_done() -> None:
    monitor = score("monitor")
    assert np.mean(monitor - score("informed")) > 1.0
    assert np.mean(score("none") - monitor) > 0.5
    for defender in ("sliding", "assigned", "assigned?laws=ssl", "sliding_detection", "pd"):
        assert np.mean(score(defender) - monitor) > 0


@pytest.mark.slow
def test_nobody_has_won() -> None:
    """No defender is unharmed by everybody, and no attacker is as good everywhere as the best is without a defence."""
    undisturbed = min(payoff("none", contestant.reference).mean() for contestant in RIVALS["defender"])
    unopposed = max(payoff(contestant.reference, "none").mean() for contestant in RIVALS["attacker"])
    for contestant in RIVALS["defender"]:
        worst = max(payoff(attacker.reference, contestant.reference).mean() for attacker in RIVALS["attacker"])
        assert worst > undisturbed + 1.0
    for attacker in RIVALS["attacker"]:
        least = min(payoff(attacker.reference, contestant.reference).mean() for contestant in RIVALS["defender"])
        assert least < unopposed - 5.0
