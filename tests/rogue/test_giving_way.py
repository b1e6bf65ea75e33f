"""Vehicles that give way keep their places, avoid the attacker, and play each episode by its own numbers."""

from __future__ import annotations

import numpy as np
import pytest

from cps_baselines.family import Family, play_family
from cps_baselines.rogue.families import GIVING_WAY, MONITOR
from cps_baselines.rogue.giving_way import GivingWay
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.play import play_episodes
from cps_envs.rogue.config import LEARNING, RogueConfig
from cps_envs.rogue.problem import ROGUE

SOLID = {"contact": "solid", "duration_s": 20.0}
COMMANDED = ROGUE.config("paper", {**SOLID, "defense_action": "command"})
START = GIVING_WAY.values(np.zeros((1, len(GIVING_WAY.numbers))))


@pytest.mark.parametrize("config", [ROGUE.config("paper", SOLID), LEARNING])
def test_giving_way_refuses_what_it_cannot_play(config: RogueConfig) -> None:
    with pytest.raises(ConfigurationError, match="defense_action"):
        GivingWay(ROGUE.game(config, 1).spec("defender"), START)


def test_giving_way_wants_all_its_numbers() -> None:
    with pytest.raises(ConfigurationError, match="24 numbers"):
        GivingWay(ROGUE.game(COMMANDED, 1).spec("defender"), START[:, 1:])


def test_vehicles_keep_their_places_when_nobody_attacks() -> None:
    outcome = play_family(GIVING_WAY, ROGUE, COMMANDED, "none", START, [0])
    assert outcome["damage"] == 0.0
    assert outcome["formation_cost_s"] < 1.0


@pytest.mark.parametrize("attacker", ["switching", "square"])
def test_giving_way_allows_less_damage_than_the_linear_law(attacker: str) -> None:
    given = play_family(GIVING_WAY, ROGUE, COMMANDED, attacker, START, [0])["damage"]
    config = ROGUE.config("paper", SOLID)
    assert given < play_episodes(ROGUE, config, {"attacker": attacker, "defender": "pd"}, [0])["damage"]


@pytest.mark.parametrize(
    ("family", "config"), [(GIVING_WAY, COMMANDED), (MONITOR, ROGUE.config("learning", {"duration_s": 10.0}))]
)
def test_every_episode_is_played_by_its_own_row(family: Family, config: RogueConfig) -> None:
    values = family.values(np.array([np.zeros(len(family.numbers)), np.ones(len(family.numbers))]))
    both = play_family(family, ROGUE, config, "switching", values, [3, 4])["return"]
    alone = [play_family(family, ROGUE, config, "switching", values[k : k + 1], [3 + k])["return"][0] for k in (0, 1)]
    assert both.tolist() == alone


def test_the_family_of_the_monitor_is_the_monitor() -> None:
    config = ROGUE.config("learning", {"duration_s": 10.0})
    values = MONITOR.values(np.zeros((1, len(MONITOR.numbers))))
    options = "&".join(f"{number.name}={number.start}" for number in MONITOR.numbers)
    players = {"attacker": "switching", "defender": f"monitor?{options}"}
    expected = play_episodes(ROGUE, config, players, [5])["return"]
    assert play_family(MONITOR, ROGUE, config, "switching", values, [5])["return"] == expected
