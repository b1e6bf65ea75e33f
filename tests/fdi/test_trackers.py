"""The attackers of the duel: what they aim at, what they may know or find out, and when they begin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from cps_baselines.family import find_family
from cps_baselines.fdi.task_tracker import KINDS, PROBE_STEPS, Manner
from cps_envs.core.types import Array
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.problem import FDI
from cps_paper.fdi.interpretations import INTERPRETATIONS
from tests.fdi.episodes import QUIET, place, play, spec_of, watched

ATTACKED = {"preset": "learning", "attack_share": 1.0, "onset_s": 0.0}
STEADY = "margin=0.5&late=0.5&swing_s=0&range_part=1"
SPEC = spec_of("attacker", preset="learning")
FAMILY = find_family("fdi-task-tracker")
START = FAMILY.values(np.zeros((1, len(FAMILY.numbers))))


def normalised_innovations(attacker: str, task: str, seeds: Sequence[int] = range(40), **overrides: Any) -> Array:
    """Innovations (steps, B, 14) in standard deviations while every reading is believed."""

    def normalised(game: FdiGame) -> Array:
        seen = game.fields["defender"].decode(game.observe("defender"))
        over = game.terminated[:, np.newaxis]
        ranges = seen["range_innovation"] / seen["range_deviation"]
        rates = seen["rate_innovation"] / seen["rate_deviation"]
        return np.where(over, np.nan, np.concatenate([ranges, rates], axis=1))

    return np.array(watched(normalised, attacker, "none", seeds, tasks=task, **ATTACKED, **overrides))


@pytest.mark.parametrize("attacker", ["tracker", "blind_tracker"])
@pytest.mark.parametrize("task", ["v4>4", "xv1+rv2>1"])
def test_trackers_keep_the_innovations_of_their_sensors_at_the_margin(attacker: str, task: str) -> None:
    found = normalised_innovations(f"{attacker}?{STEADY}", task)[12:30]
    attacked = FDI.config("learning", {"tasks": task}).listed_tasks[0].sensors.flags(4, rear=True)
    np.testing.assert_allclose(np.nanmean(found, axis=(0, 1))[attacked], 0.5, atol=0.15)


def test_a_margin_below_zero_opens_the_gap_and_one_above_closes_it() -> None:
    gaps = []
    for margin in (-0.5, 0.5):
        attacker = f"tracker?margin={margin}&late={margin}&swing_s=0"
        found = watched(
            lambda game: game.state.error[:, 3].mean(), attacker, seeds=range(40), tasks="v4>4", horizon=30, **ATTACKED
        )
        gaps.append(found[-1])
    assert gaps[0] > 0.5
    assert gaps[1] < -0.5


@pytest.mark.parametrize("attacker", ["tracker", "blind_tracker", "swing"])
def test_nothing_is_injected_before_the_onset_or_without_attack(attacker: str) -> None:
    early = watched(
        lambda game: (game.state.step < game.state.onset) & (game.state.injection != 0).any(axis=1),
        attacker,
        seeds=range(40),
        preset="learning",
    )
    assert not np.array(early).any()
    assert play(attacker, seeds=range(5), preset="learning", attack_share=0.0)["injected_share"].max() == 0


def test_swing_brakes_first_and_then_accelerates() -> None:
    levels = watched(
        lambda game: game.state.injection[0, place("v4")] / 0.25,
        "swing?swing_s=1&open=0.5&close=0.8",
        "always?action=1",
        preset="learning",
        tasks="v4>4",
        horizon=30,
        **QUIET,
    )
    assert levels[0] == 0
    assert levels[1:11] == [-10] * 10
    assert levels[11:15] == [16] * 4


def test_swing_plays_without_a_filter_too() -> None:
    assert play("swing?swing_s=0.3", attacked="v4", **INTERPRETATIONS["clip"])["impact_speed_mps"][0] > 2


def starting() -> Any:
    """The attacker with which a search begins."""
    return FAMILY.build(SPEC, START)


def injected(defender: Any, task: Any = "v4>4", sensor: Any = "v4") -> Any:
    """The injections (steps, B) of a sensor as parts of the largest, attacked from the start."""
    found = watched(
        lambda game: np.where(game.terminated, 0.0, game.state.injection[:, place(sensor)] / 5.0),
        starting(),
        defender,
        range(20),
        **{**ATTACKED, "tasks": task},
    )
    return np.array(found)


def test_it_lies_as_much_as_it_can_where_nobody_defends() -> None:
    levels = injected("none")
    assert np.all(levels[PROBE_STEPS + 2 : 15] == -1)
    assert levels[40:].max() == 1


@pytest.mark.parametrize("defender", ["cusum", "bank"])
def test_it_stays_quiet_where_somebody_defends(defender: Any) -> None:
    levels = np.abs(injected(defender)[PROBE_STEPS + 2 : 40])
    assert (levels.max(axis=0) < 1).mean() > 0.9


def test_it_gains_more_than_the_tracker_where_nobody_defends() -> None:
    settings = {"preset": "learning", "attack_share": 1.0, "seeds": range(40)}
    found, tracker = (play(attacker, **settings)["return"].mean() for attacker in (starting(), "tracker"))
    assert found > tracker + 0.5


@pytest.mark.parametrize(("task", "kind"), [("v4>4", 0), ("xv4>4", 1), ("xv2>2", 2), ("xv1+rv2>1", 3)])
def test_kinds_of_tasks(task: Any, kind: Any) -> None:
    flags = FDI.config("learning", {"tasks": task}).listed_tasks[0].sensors.flags(4, rear=True)
    assert starting()._kinds(np.array([flags]))[0] == kind
    assert len(KINDS) == 4


def test_a_kind_is_played_by_its_own_manner() -> None:
    values = START.copy()
    values[0, len(Manner._fields)] += 0.5  # the margin of the second kind
    settings = {"preset": "learning", "attack_share": 1.0, "seeds": range(10), "defender": "cusum"}
    for task, alike in (("v4>4", True), ("xv4>4", False)):
        found, before = (play(FAMILY.build(SPEC, each), tasks=task, **settings)["return"] for each in (values, START))
        assert np.array_equal(found, before) == alike
