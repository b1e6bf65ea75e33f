from __future__ import annotations

from typing import Any

import numpy as np
import pytest

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
