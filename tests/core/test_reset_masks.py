from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

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
    envs = ToyAttackVectorEnv(3, autoreset_mode=AutoresetMode.DISABLED, duration_s=3.0)
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
