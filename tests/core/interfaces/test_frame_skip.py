"""Actions that are held for several decisions, and games at the end of their episodes."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode

from cps_envs.core.errors import ConfigurationError
from tests.core.toy import ToyAttackEnv, ToyConfig, ToyDefenseVectorEnv, ToyGame

QUIET: dict[str, Any] = {"opponent": "none", "reach_m": 0.0}


def started(num_envs: int = 2) -> ToyGame:
    game = ToyGame(ToyConfig(reach_m=0.0), num_envs)
    game.reset(np.ones(num_envs, np.bool_), [seeding.np_random(b)[0] for b in range(num_envs)])
    return game


def test_a_held_action_ends_with_the_episode() -> None:
    env = ToyAttackEnv(frame_skip=3, **QUIET)  # of 4 decisions
    env.reset(seed=0)
    assert env.step(1)[2:4] == (False, False)
    assert env.game.elapsed.tolist() == [9]
    assert env.step(1)[2:4] == (True, False)
    assert env.game.elapsed.tolist() == [12]


def test_nothing_is_observed_while_an_action_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    looks = []
    observe = ToyGame.observe
    monkeypatch.setattr(ToyGame, "observe", lambda game, role: [looks.append(role), observe(game, role)][1])
    env = ToyDefenseVectorEnv(2, frame_skip=6, **QUIET)
    env.reset(seed=0)
    env.step(np.zeros((2, 2)))
    assert looks == ["defender"] * 2  # after the reset and after the step


def test_environments_in_a_batch_are_held_each_to_its_own_end() -> None:
    env = ToyDefenseVectorEnv(2, frame_skip=5, autoreset=AutoresetMode.DISABLED, **QUIET)
    env.reset(seed=0)
    env.step(np.zeros((2, 2)))
    env.reset(options={"reset_mask": np.array([True, False])})
    ends = [env.step(np.zeros((2, 2)))[2].tolist() for _ in range(2) if not env._ended.any()]
    assert ends == [[False, False], [False, True]]
    assert env.game.elapsed.tolist() == [10, 12]


def test_the_limit_of_steps_counts_held_actions_once() -> None:
    env: Any = gymnasium.make_vec("toys/ToyDefense-v0", 1, "vector_entry_point", frame_skip=2, max_episode_steps=3)
    env.reset(seed=0)
    assert [bool(env.step(np.zeros((1, 2)))[3][0]) for _ in range(3)] == [False, False, True]
    assert env.game.elapsed.tolist() == [6]


@pytest.mark.parametrize("frame_skip", [0, -1, 2.0, True, "2"])
def test_nonsense_is_refused(frame_skip: Any) -> None:
    for make in (ToyAttackEnv, ToyDefenseVectorEnv):
        with pytest.raises(ConfigurationError, match=r"frame_skip = .* must be a whole number"):
            make(frame_skip=frame_skip)


def test_a_game_says_which_environments_are_at_their_end() -> None:
    game = started()
    game.advance({}, np.array([True, True]), 10)
    game.advance({}, np.array([False, True]), 2)
    with pytest.raises(ResetNeeded, match=r"environments \[1\] cannot advance by 1 game steps.*has 12 and \[12\] are"):
        game.advance({}, np.array([True, True]), 1)
    assert game.elapsed.tolist() == [10, 12]
    game.advance({}, np.array([True, False]), 2)


def test_a_copy_of_a_game_knows_how_far_it_is() -> None:
    game, copy = started(), ToyGame(ToyConfig(reach_m=0.0), 2)
    copy.elapsed[:], copy.generators = 12, list(game.generators)
    with pytest.raises(ResetNeeded, match=r"environments \[0, 1\] cannot advance"):
        copy.advance({}, np.ones(2, np.bool_), 1)


def test_terminated_environments_may_be_marked_beyond_the_end() -> None:
    game = started()
    game.advance({}, np.array([True, True]), 12)
    game.terminated[:] = True
    assert game.advance({}, np.array([True, True]), 5).tolist() == [0.0, 0.0]
    game.terminated[1] = False
    with pytest.raises(ResetNeeded, match=r"\[1\]"):
        game.advance({}, np.array([True, True]), 1)
