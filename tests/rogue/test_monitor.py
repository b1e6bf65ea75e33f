"""The monitor finds who disobeys, forgives who obeys again, and suspects nobody for nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.monitor import NOBODY, Monitor, strength
from cps_envs.core.policy import State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array
from cps_envs.rogue.actions import Engine
from cps_envs.rogue.problem import ROGUE
from tests.rogue.test_contested import config_of, play


def suspicions(attacker: str, count: int, **overrides: Any) -> tuple[Array, Array]:
    """The suspects (steps, B) of the monitor, and the seats (B,)."""
    config, found, seats = config_of(**overrides), [], []

    class Watched(Monitor):
        def act(self, seen: Seen, state: State) -> tuple[Array, State]:
            actions, state = super().act(seen, state)
            found.append(state[1].copy())
            return actions, state

    watched = Watched(ROGUE.game(config, 1).spec("defender"))
    play(attacker, watched, count, lambda game: seats.append(game.drawn["attacker"].copy()), **overrides)
    return np.array(found), seats[0]


def test_the_monitor_suspects_nobody_in_honest_episodes() -> None:
    """No false alarm in 150 episodes: with 95 % confidence the rate is below 2 %."""
    found, _ = suspicions("none", 150, attack_share=0.0)
    assert np.all(found == NOBODY)


@pytest.mark.parametrize("attacker", ["always?action=1", "always?action=-1", "contested?against=monitor"])
def test_the_monitor_finds_who_disobeys_within_seconds(attacker: str) -> None:
    found, seats = suspicions(attacker, 60, attack_share=1.0, onset_s=10.0)
    assert np.all(found[:100] == NOBODY)
    right = found[100:] == seats
    delay_s = np.where(right.any(axis=0), 0.1 * right.argmax(axis=0), np.inf)
    assert np.quantile(delay_s, 0.8) < 4.0
    wrong = (found[100:] != seats) & (found[100:] != NOBODY)
    assert wrong.mean() < 0.05


def test_the_monitor_forgives_whoever_obeys_again() -> None:
    found, seats = suspicions("strike?strike_s=3&period_s=40", 40, attack_share=1.0, onset_s=5.0)
    struck = (found[50:100] == seats).any(axis=0)
    assert struck.mean() > 0.8
    assert np.mean(found[400, struck] == NOBODY) > 0.8  # 32 s after the end of the strike


@pytest.mark.parametrize(("ratio", "share"), [(1.0, 0.0), (1.3, 1.0)])
def test_the_monitor_tells_a_strong_engine_from_an_intact_one(ratio: float, share: float) -> None:
    """An attacker at full throttle, whose engine the defender is not told."""
    config, found = config_of(attack_share=1.0, onset_s=5.0, power_ratio=ratio), []

    class Watched(Monitor):
        def act(self, seen: Seen, state: State) -> tuple[Array, State]:
            actions, state = super().act(seen, state)
            found.append(state[2].copy())
            return actions, state

    watched = Watched(ROGUE.game(config, 1).spec("defender"))
    play("always?action=1", watched, 40, attack_share=1.0, onset_s=5.0, power_ratio=ratio)
    strong = found[200] > 0.75  # 15 s after the onset
    assert np.mean(strong) == pytest.approx(share, abs=0.15)


def test_strength_is_what_lies_beyond_full_effort_on_the_nearer_side() -> None:
    engine = Engine(5.0, 0.1, -1.0, 1.0)
    assert strength(20.0, 4.0, engine) == pytest.approx(1.0)  # full driving reaches 5 - 2
    assert strength(20.0, -8.5, engine) == pytest.approx(1.5)  # full braking reaches -5 - 2
    assert strength(20.0, 0.0, engine) == pytest.approx(-3.0)
