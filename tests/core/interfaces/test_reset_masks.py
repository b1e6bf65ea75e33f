from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from cps_envs.core.picture.rendering import Renderer
from tests.core.toy import ToyAttackVectorEnv

WRONG: list[Any] = [
    [True, False, True],
    np.array([1, 0, 1]),
    np.array([True, False]),
    np.array([[True, False, True]]),
    np.zeros(3, np.bool_),
]


@pytest.mark.parametrize("mask", WRONG, ids=["list", "numbers", "short", "deep", "empty"])
def test_a_mask_is_a_boolean_array_with_an_entry_for_each_environment(mask: Any) -> None:
    envs = ToyAttackVectorEnv(3)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match="reset_mask"):
        envs.reset(options={"reset_mask": mask})


def test_only_marked_environments_start_again() -> None:
    envs = ToyAttackVectorEnv(3)
    envs.reset(seed=0)
    envs.step(np.zeros_like(envs.action_space.sample()))
    envs.reset(options={"reset_mask": np.array([True, False, True])})
    assert (envs.game.elapsed == 0).tolist() == [True, False, True]


def test_a_batch_is_one_environment_unless_told_otherwise() -> None:
    assert ToyAttackVectorEnv().num_envs == 1
    assert ToyAttackVectorEnv().frame_skip == 1


def test_every_ended_environment_has_to_be_reset() -> None:
    envs = ToyAttackVectorEnv(3, autoreset=AutoresetMode.DISABLED, duration_s=3.0)
    envs.reset(seed=0)
    nothing, ended = np.zeros(3, np.int64), np.zeros(3, np.bool_)
    while not ended.all():
        _, _, terminated, truncated, _ = envs.step(nothing)
        ended = terminated | truncated
        if ended.any() and not ended.all():
            envs.reset(options={"reset_mask": ended})
    envs.reset(options={"reset_mask": np.array([True, False, False])})
    with pytest.raises(ResetNeeded, match=r"environments \[1, 2\] have ended"):
        envs.step(nothing)
    envs.reset(options={"reset_mask": np.array([False, True, True])})
    envs.step(nothing)


def test_an_ended_environment_starts_again_in_the_same_step() -> None:
    envs = ToyAttackVectorEnv(2, autoreset=AutoresetMode.SAME_STEP, duration_s=3.0)
    envs.reset(seed=0)
    ended, info = np.zeros(2, np.bool_), {}
    while not ended.any():
        assert "final_obs" not in info
        observation, _, terminated, truncated, info = envs.step(np.zeros(2, np.int64))
        ended = terminated | truncated
    np.testing.assert_array_equal(info["_final_obs"], ended)
    assert (envs.game.elapsed[ended] == 0).all()
    assert all(not np.array_equal(info["final_obs"][b], observation[b]) for b in np.flatnonzero(ended))


@pytest.mark.parametrize(("mode", "shown"), [("human", 1), ("rgb_array", 0), (None, 0)])
def test_only_people_are_shown_every_step(mode: str | None, shown: int, monkeypatch: pytest.MonkeyPatch) -> None:
    envs = ToyAttackVectorEnv(2, render_mode=mode)
    frames: list[int] = []
    monkeypatch.setattr(Renderer, "show", lambda _: frames.append(1))
    envs.reset(seed=0)
    assert len(frames) == shown
    envs.step(np.zeros(2, np.int64))
    assert len(frames) == 2 * shown
