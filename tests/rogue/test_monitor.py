"""The monitor finds who disobeys and suspects nobody for nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.monitor import NOBODY, Monitor, strength
from cps_envs.core.types import Array
from cps_envs.rogue.actions import Body
from tests.episodes import noted
from tests.rogue.test_contested import play, spec_of, watched


def suspicions(attacker: str, count: int, **overrides: Any) -> tuple[Array, Array]:
    """The suspects (steps, B) of the monitor, and the seats (B,)."""
    monitor = Monitor(spec_of("defender", **overrides))
    suspects = noted(monitor, lambda seen, orders, state: state[1].copy())
    seats = watched(lambda game: game.drawn["attacker"].copy(), attacker, monitor, count, **overrides)
    return np.array(suspects), seats[0]


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
    world = {"attack_share": 1.0, "onset_s": 5.0, "power_ratio": ratio}
    monitor = Monitor(spec_of("defender", **world))
    strengths = noted(monitor, lambda seen, orders, state: state[2].copy())
    play("always?action=1", monitor, 40, **world)
    assert np.mean(strengths[200] > 0.75) == pytest.approx(share, abs=0.15)  # 15 s after the onset


def test_strength_is_what_lies_beyond_full_effort_on_the_nearer_side() -> None:
    engine = Body(5.0, 0.1, 4.5, 1.0, 3.0, -1.0, 1.0)
    assert strength(20.0, 4.0, engine) == pytest.approx(1.0)  # full driving reaches 5 - 2
    assert strength(20.0, -8.5, engine) == pytest.approx(1.5)  # full braking reaches -5 - 2
    assert strength(20.0, 0.0, engine) == pytest.approx(-3.0)
