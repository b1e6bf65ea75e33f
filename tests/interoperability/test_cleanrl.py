"""The single-file PPO on native vector environments."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")
sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))

from cleanrl_ppo import Args, advantages, train


def test_trains() -> None:
    history = train(Args(env_id="cps_envs/HvacAttack-v0", num_envs=4, num_steps=720, total_steps=2880, update_epochs=1))
    assert len(history) == 1
    assert np.isfinite(history).all()


def test_advantages_are_returns_minus_values_without_discount() -> None:
    import torch

    rewards, values = torch.rand(6, 3), torch.rand(6, 3)
    ended = torch.zeros(6, 3)
    ended[-1] = 1.0
    found = advantages(rewards, values, ended, torch.rand(3), Args(gamma=1.0, gae_lambda=1.0))
    expected = rewards.flip(0).cumsum(0).flip(0) - values
    np.testing.assert_allclose(found.numpy(), expected.numpy(), atol=1e-5)
