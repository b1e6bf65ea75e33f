"""A defender that is told who attacks: calm until then, and better than those that order controllers only."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.families import ESCORT
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import Array
from cps_envs.rogue.controllers import CONTROLLERS, FRONT, SLIDING
from cps_envs.rogue.panels import CHALLENGE
from cps_envs.rogue.problem import ROGUE
from tests.episodes import spec_of, watched
from tests.turns import in_turn

EPISODES = range(650_000, 650_030)


def paid(attacker: str, defender: str) -> Array:
    players = {"attacker": attacker, "defender": defender}
    return play_episodes(ROGUE, ROGUE.config("learning", {}), players, EPISODES)["return"]


@pytest.mark.parametrize("rival", in_turn(CHALLENGE["attacker"][:5], 5), ids=lambda rival: rival.name)
def test_it_lets_less_pass_than_controllers_do(rival: Contestant) -> None:
    told = paid(rival.policy, "escort")
    for other in ("sliding", "monitor", "assigned?laws=ssl", "sliding_detection"):
        assert np.mean(paid(rival.policy, other) - told) > 1.0, other


def test_all_slide_until_the_onset_and_those_behind_follow_from_then_on() -> None:
    def see(game: Any) -> tuple[float, dict[str, Any], list[int]]:
        return game.elapsed[0] * game.config.control_period_s, game.truth(0), game.state.controller[0].tolist()

    shown = [seen for seed in EPISODES[:4] for seen in watched(ROGUE, see, "square", "escort", [seed], "learning")[1:]]
    for until_s, truth, laws in shown:  # the laws were ordered a decision before
        if until_s <= truth["onset_s"]:
            assert set(laws[: truth["seat"] + 2]) == {SLIDING}
        elif until_s > truth["onset_s"] + 0.1:
            assert set(laws[: truth["seat"] + 1]) == {FRONT}
            assert laws[truth["seat"] + 1] >= len(CONTROLLERS)


def test_it_plays_as_its_family() -> None:
    spec = spec_of(ROGUE, "defender", "learning")
    policy = resolve_policy("escort?near_m=5.0", spec)
    assert ESCORT.row({"near_m": 5.0})[0, ESCORT.names.index("near_m")] == 5.0
    assert policy.privileged == {"truth"}
    with pytest.raises(ConfigurationError, match='needs defense_action="either"'):
        resolve_policy("escort", spec_of(ROGUE, "defender", "paper"))
