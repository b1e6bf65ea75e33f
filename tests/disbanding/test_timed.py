"""Attacks that a learner plans ahead."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.declare.actions import choices_of
from cps_envs.core.policies.adapter import adapter_of
from cps_envs.core.types import State
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.timed import AFTER, BEFORE, DELAYS_S, IDLE, NO_JAM, FromFront, Timed
from tests.disbanding.rounds import game_of, started_match
from tests.episodes import seen_by

FRONT, LINK = 10, 19  # disband the front platoon; block the radio behind it
IN_5_S = int(np.flatnonzero(DELAYS_S == 5)[0])


def drive(game: DisbandingGame, adapter: Timed, choices: list[tuple[int, int, int]], seconds: int) -> list[int]:
    """The actions of environment 0 when the agent makes these choices, one after the other, and then waits."""
    state: State = adapter.begin(game.num_envs)
    taken, left = [], list(choices)
    for _ in range(seconds):
        now = seen_by(game, adapter)
        free = bool(adapter.active(now, state)[0, 0])
        choice = left.pop(0) if free and left else (0, 0, NO_JAM)
        action, state = adapter.act(now, state, np.full((game.num_envs, 1, 3), choice))
        taken.append(int(action[0]))
        game.advance({"attacker": action}, np.ones(game.num_envs, np.bool_), 10)
    return taken


def game_that_opens(earliest_s: int) -> DisbandingGame:
    overrides: dict[str, Any] = {"earliest_attack_s": earliest_s, "attack_budget": 2, "quiet_share": 0.0}
    game = game_of(1, **overrides)
    started_match(game)
    return game


def test_what_is_planned_is_done_in_time() -> None:
    game = game_that_opens(1)
    taken = drive(game, Timed(game.spec("attacker")), [(0, 0, NO_JAM), (IN_5_S, FRONT, AFTER)], 12)
    assert taken == [0, 0, 0, 0, 0, 0, FRONT, LINK, 0, 0, 0, 0]


def test_a_plan_waits_until_it_is_legal() -> None:
    game = game_that_opens(9)
    taken = drive(game, Timed(game.spec("attacker")), [(0, FRONT, NO_JAM), (0, FRONT - 1, NO_JAM)], 20)
    assert [second for second, action in enumerate(taken) if action == FRONT] == [9]
    assert [second for second, action in enumerate(taken) if action == FRONT - 1] == [14], "the pause is 5 s"


@pytest.mark.parametrize("budget_s", [5, 0])
def test_a_jam_comes_a_second_before_the_attack_where_it_is_legal(budget_s: int) -> None:
    game = game_that_opens(3)
    game.state.jam_steps[:] = 100 * budget_s
    taken = drive(game, Timed(game.spec("attacker")), [(1, FRONT, BEFORE), (0, 1, AFTER)], 12)
    expected = {5: [(3, LINK), (4, FRONT), (9, 1)], 0: [(3, FRONT), (8, 1)]}[budget_s]
    assert [(second, action) for second, action in enumerate(taken) if action] == expected


def test_a_plan_that_became_impossible_is_dropped() -> None:
    game = game_that_opens(1)
    adapter = Timed(game.spec("attacker"))
    taken = drive(game, adapter, [(1, FRONT, NO_JAM), (0, FRONT, NO_JAM), (0, 3, NO_JAM)], 12)
    assert [action for action in taken if action] == [FRONT, 3]


def test_platoons_are_counted_from_the_front_among_those_that_are_intact() -> None:
    game = game_that_opens(1)
    game.budget[:] = 3
    adapter = FromFront(game.spec("attacker"))
    choices = [(0, 1, NO_JAM), (0, 1, BEFORE), (0, 3, NO_JAM)]
    taken = [action for action in drive(game, adapter, choices, 20) if action]
    assert taken == [10, 9 + FRONT - 1, 9, 6], "the front one; the next one, behind a jam; the third of those left"
    game.budget[:] = 1
    masks = adapter.masks(seen_by(game, adapter), adapter.begin(1))
    assert masks is not None
    assert np.flatnonzero(masks[0, 0, 4:15]).tolist() == list(range(8)), "or none; three are gone"


def test_a_delay_runs_from_when_it_is_legal() -> None:
    game = game_that_opens(9)
    taken = drive(game, FromFront(game.spec("attacker")), [(1, 1, NO_JAM), (0, 1, NO_JAM)], 40)
    assert [(second, action) for second, action in enumerate(taken) if action] == [(29, 10), (34, 9)]


def test_beyond_the_last_platoon_it_is_the_last_one() -> None:
    game = game_of(2, "easy", num_platoons=(4, 6), attack_budget=2, earliest_attack_s=1)
    started_match(game)
    adapter = FromFront(game.spec("attacker"))
    rear, front = (
        adapter.act(seen_by(game, adapter), adapter.begin(2), np.tile([3, choice], (2, 1, 1)))[1][1]
        for choice in (6, 1)
    )
    assert rear.tolist() == [1, 1], "however many there are"
    assert front.tolist() == [game.num_present_platoons(b) for b in range(2)]


def test_masks_tell_what_can_be_planned() -> None:
    game = game_that_opens(30)
    adapter = Timed(game.spec("attacker"))
    now = seen_by(game, adapter)
    delays = len(DELAYS_S)
    free = adapter.masks(now, adapter.begin(1))[0, 0]
    assert free.all(), "nothing is legal yet, but all of it will be"
    planned = (np.array([3]), np.array([FRONT]), np.array([NO_JAM]))
    assert np.flatnonzero(adapter.masks(now, planned)[0, 0]).tolist() == [0, delays, delays + FRONT + 1]
    game.budget[:], game.state.jam_steps[:] = 0, 0
    spent = adapter.masks(seen_by(game, adapter), adapter.begin(1))[0, 0]
    assert np.flatnonzero(spent[delays:]).tolist() == [0, FRONT + 1]


def test_the_agent_sees_its_plan() -> None:
    game = game_that_opens(1)
    adapter = Timed(game.spec("attacker"))
    rows = adapter.observe(seen_by(game, adapter), (np.array([50]), np.array([FRONT]), np.array([NO_JAM])))
    shown = adapter.fields.decode(rows)
    assert rows.shape == (1, 1, adapter.fields.size)
    assert (shown["plans"][0, 0], shown["due_in_s"][0, 0]) == (1, 50)
    idle = adapter.fields.decode(adapter.observe(seen_by(game, adapter), adapter.begin(1)))
    assert (idle["plans"][0, 0], idle["due_in_s"][0, 0]) == (0, 0)


@pytest.mark.parametrize("name", ["timed", "from_front"])
@pytest.mark.parametrize("preset", ["paper", "easy", "learning"])
def test_any_choices_are_legal_actions(preset: str, name: str) -> None:
    game = game_of(3, preset, **({"num_platoons": (4, 6)} if preset == "easy" else {}))
    started_match(game)
    adapter, generator = adapter_of(game.spec("attacker"), name), np.random.default_rng(0)
    state = adapter.begin(3)
    for _ in range(40):
        now = seen_by(game, adapter)
        masks = adapter.masks(now, state)
        assert masks is not None
        parts = np.split(masks[:, 0], np.cumsum(choices_of(adapter.action_space))[:-1], axis=1)
        chosen = [np.where(part, generator.random(part.shape), -1).argmax(axis=1) for part in parts]
        action, state = adapter.act(now, state, np.stack(chosen, axis=1)[:, np.newaxis])
        assert game.action_mask("attacker")[np.arange(3), action].all()  # type: ignore[index]
        game.advance({"attacker": action}, np.ones(3, np.bool_), 10)
    assert (state[0] >= IDLE).all()
