"""The attackers of the duel: what they aim at, what they may know, and when they begin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from cps_envs.core.play import play_episodes
from cps_envs.core.types import Array
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.problem import FDI
from tests.fdi.duel import QUIET, place
from tests.fdi.episodes import play

STEADY = "margin=0.5&late=0.5&swing_s=0&range_part=1"


def normalised_innovations(attacker: str, task: str, seeds: Sequence[int] = range(40), **overrides: Any) -> Array:
    """Innovations (steps, B, 14) in standard deviations while every reading is believed."""
    config, found = FDI.config("learning", {"tasks": task, "attack_share": 1.0, "onset_s": 0.0, **overrides}), []

    def look(game: FdiGame) -> None:
        seen = game.fields["defender"].decode(game.observe("defender"))
        over = game.terminated[:, np.newaxis]
        ranges = seen["range_innovation"] / seen["range_deviation"]
        rates = seen["rate_innovation"] / seen["rate_deviation"]
        found.append(np.where(over, np.nan, np.concatenate([ranges, rates], axis=1)))

    play_episodes(FDI, config, {"attacker": attacker, "defender": "none"}, seeds, on_step=look)
    return np.array(found)


@pytest.mark.parametrize("attacker", ["tracker", "blind_tracker"])
@pytest.mark.parametrize("task", ["v4>4", "xv1+rv2>1"])
def test_trackers_keep_the_innovations_of_their_sensors_at_the_margin(attacker: str, task: str) -> None:
    found = normalised_innovations(f"{attacker}?{STEADY}", task)[12:30]
    attacked = FDI.config("learning", {"tasks": task}).listed_tasks[0].sensors.flags(4, rear=True)
    np.testing.assert_allclose(np.nanmean(found, axis=(0, 1))[attacked], 0.5, atol=0.13)


def test_a_margin_below_zero_opens_the_gap_and_one_above_closes_it() -> None:
    gaps = []
    for margin in (-0.5, 0.5):
        options = f"margin={margin}&late={margin}&swing_s=0"
        games = []
        config = FDI.config("learning", {"tasks": "v4>4", "attack_share": 1.0, "onset_s": 0.0, "horizon": 30})
        play_episodes(FDI, config, {"attacker": f"tracker?{options}"}, range(40), on_step=games.append)
        gaps.append(games[-1].state.error[:, 3].mean())
    assert gaps[0] > 0.5
    assert gaps[1] < -0.5


@pytest.mark.parametrize("attacker", ["tracker", "blind_tracker", "swing"])
def test_nothing_is_injected_before_the_onset_or_without_attack(attacker: str) -> None:
    injected = []

    def look(game: FdiGame) -> None:
        injected.append((game.state.step < game.state.onset) & (game.state.injection != 0).any(axis=1))

    play_episodes(FDI, FDI.config("learning", {}), {"attacker": attacker}, range(40), on_step=look)
    assert not np.array(injected).any()
    assert play(attacker, seeds=range(5), preset="learning", attack_share=0.0)["injected_share"].max() == 0


def test_swing_brakes_first_and_then_accelerates() -> None:
    levels = []

    def look(game: FdiGame) -> None:
        levels.append(game.state.injection[0, place("v4")] / 0.25)

    config = FDI.config("learning", {**QUIET, "tasks": "v4>4", "horizon": 30})
    options = "swing?swing_s=1&open=0.5&close=0.8"
    play_episodes(FDI, config, {"attacker": options, "defender": "always?action=1"}, [0], on_step=look)
    assert levels[0] == 0
    assert levels[1:11] == [-10] * 10
    assert levels[11:15] == [16] * 4


def test_swing_plays_without_a_filter_too() -> None:
    assert play("swing?swing_s=0.3", preset="clip", attacked="v4")["impact_speed_mps"][0] > 2
