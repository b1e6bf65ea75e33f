"""The monitor finds who disobeys and suspects nobody for nothing; who boxes the attacker in leaves it no gap."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.family import play_family
from cps_baselines.rogue.boxing_in import BoxingIn, squeeze
from cps_baselines.rogue.families import BOXING_IN
from cps_baselines.rogue.monitor import NOBODY, Monitor, strength
from cps_baselines.searched import searched
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import Array
from cps_envs.rogue.actions import Engine
from cps_envs.rogue.config import LEARNING, RogueConfig
from cps_envs.rogue.problem import ROGUE
from tests.episodes import noted
from tests.rogue.test_contested import play, spec_of, watched

SOLID = {"contact": "solid", "duration_s": 20.0}
COMMANDED = ROGUE.config("paper", {**SOLID, "defense_action": "command"})
START = BOXING_IN.values(np.zeros((1, len(BOXING_IN.numbers))))


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
    engine = Engine(5.0, 0.1, -1.0, 1.0)
    assert strength(20.0, 4.0, engine) == pytest.approx(1.0)  # full driving reaches 5 - 2
    assert strength(20.0, -8.5, engine) == pytest.approx(1.5)  # full braking reaches -5 - 2
    assert strength(20.0, 0.0, engine) == pytest.approx(-3.0)


@pytest.mark.parametrize("config", [ROGUE.config("paper", SOLID), LEARNING])
def test_boxing_in_refuses_what_it_cannot_play(config: RogueConfig) -> None:
    with pytest.raises(ConfigurationError, match="defense_action"):
        BoxingIn(ROGUE.game(config, 1).spec("defender"), START)


def test_boxing_in_wants_all_its_numbers() -> None:
    with pytest.raises(ConfigurationError, match="38 numbers"):
        BoxingIn(ROGUE.game(COMMANDED, 1).spec("defender"), START[:, 1:])


def test_vehicles_keep_their_places_when_nobody_attacks() -> None:
    outcome = play_family(BOXING_IN, ROGUE, COMMANDED, "none", START, [0])
    assert outcome["damage"] == 0.0
    assert outcome["formation_cost_s"] < 1.0


@pytest.mark.parametrize("attacker", ["switching", "square"])
def test_boxing_in_allows_less_damage_than_the_linear_law(attacker: str) -> None:
    given = play_family(BOXING_IN, ROGUE, COMMANDED, attacker, START, [0])["damage"]
    config = ROGUE.config("paper", SOLID)
    assert given < play_episodes(ROGUE, config, {"attacker": attacker, "defender": "pd"}, [0])["damage"]


@pytest.mark.parametrize("free", [-9.0, -3.0, 0.0, 4.0])
@pytest.mark.parametrize("wanted", [-2.0, 0.0, 1.0])
def test_an_attacker_that_is_squeezed_opens_no_gap(free: float, wanted: float) -> None:
    """Whatever its effort; the pressures and the limits are those of a game at 25 m/s, with an engine of ratio 1.3."""
    rear, front = squeeze(wanted, free, 1.0, 1.5, (7.5, 2.5))
    assert rear > 0.5 * (free + front)  # what the other two do without it
    assert front < 0.5 * (free + rear)
    assert rear <= 2.5
    assert front >= -7.5


def test_the_vehicles_ahead_box_in_whoever_drives_slower_than_the_platoon() -> None:
    assert searched("rogue", "box_in")["ahead_slow_mps"] < COMMANDED.reference_speed_mps
