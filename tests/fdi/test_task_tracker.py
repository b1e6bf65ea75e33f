"""The attacker with a manner for each kind of task: what it finds out, and that it plays by its numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.family import Members, find_family
from cps_baselines.fdi.task_tracker import KINDS, PROBE_STEPS, Manner
from cps_envs.core.play import play_episodes
from cps_envs.fdi.problem import FDI
from tests.fdi.duel import place
from tests.fdi.episodes import play, spec_of

SPEC = spec_of("attacker", preset="learning")
FAMILY = find_family("fdi-task-tracker")
START = FAMILY.values(np.zeros((1, len(FAMILY.numbers))))


def starting() -> Any:
    """The attacker with which a search begins."""
    return FAMILY.build(SPEC, START)


def injected(defender: Any, task: Any = "v4>4", sensor: Any = "v4") -> Any:
    """The injections (steps, B) of a sensor as parts of the largest, attacked from the start."""
    found = []
    config = FDI.config("learning", {"tasks": task, "attack_share": 1.0, "onset_s": 0.0})

    def look(game: Any) -> None:
        found.append(np.where(game.terminated, 0.0, game.state.injection[:, place(sensor)] / 5.0))

    play_episodes(FDI, config, {"attacker": starting(), "defender": defender}, range(20), on_step=look)
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


def test_each_episode_is_played_by_its_own_numbers() -> None:
    values = FAMILY.values(np.random.default_rng(1).normal(size=(6, len(FAMILY.numbers))))
    together = play(Members(SPEC, FAMILY, values), "cusum", preset="learning", seeds=range(6))
    for b in range(6):
        alone = play(FAMILY.build(SPEC, values[b : b + 1]), "cusum", preset="learning", seeds=[b])
        assert alone["return"][0] == together["return"][b]
