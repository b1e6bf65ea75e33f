"""Rollouts for stable-baselines3 without the rows whose action had no effect."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import torch
from gymnasium import spaces
from stable_baselines3 import PPO

from cps_agents.sb3 import ActiveBuffer, StickyPolicy, make

SHORT = {"num_steps": 90, "window_steps": 40, "onset_step": 45, "compromised_weights": (0, 1, 1), "frame_skip": 5}
TINY = {"n_steps": 18, "batch_size": 16, "n_epochs": 1}


@pytest.fixture(scope="module")
def model() -> PPO:
    """An attacker of HVAC after one update, of 2 days with 4 sensors, each an agent."""
    envs = make("HvacAttack", 2, adapter="expected", **SHORT)
    return PPO(StickyPolicy, envs, **{**envs.settings, **TINY}).learn(1)


def test_batches_hold_the_rows_that_acted_and_no_others(model: PPO) -> None:
    buffer: Any = model.rollout_buffer
    acted = buffer.swap_and_flatten(buffer.acting[..., np.newaxis])[:, 0]
    assert 0 < acted.sum() < 0.4 * acted.size  # honest sensors, and all before the onset, have no choice
    batches = list(buffer.get())
    assert sum(len(batch.observations) for batch in batches) == acted.sum()
    rows = np.concatenate([batch.observations.numpy() for batch in batches])
    wanted = buffer.observations[acted]
    np.testing.assert_array_equal(rows[np.lexsort(rows.T)], wanted[np.lexsort(wanted.T)])


def test_advantages_are_normal_over_the_rows_that_acted(model: PPO) -> None:
    buffer: Any = model.rollout_buffer
    found = torch.cat([batch.advantages for batch in buffer.get()])
    assert float(found.mean()) == pytest.approx(0, abs=0.1)
    assert 0.5 < float(found.std()) < 1.1
    assert float(found.abs().max()) <= 4


def test_a_leftover_too_small_for_a_gradient_is_left_out() -> None:
    buffer = ActiveBuffer(9, spaces.Box(-1.0, 1.0, (3,)), spaces.Discrete(2), n_envs=1)  # nobody notes who acts
    for _ in range(9):
        buffer.add(np.zeros((1, 3)), np.zeros(1), np.zeros(1), np.zeros(1), torch.zeros(1), torch.zeros(1))
    assert [len(batch.observations) for batch in buffer.get(8)] == [8]
    assert [len(batch.observations) for batch in buffer.get(6)] == [6, 3]


def test_a_model_is_saved_and_loaded_with_its_buffer(model: PPO, tmp_path: Path) -> None:
    model.save(tmp_path / "model.zip")
    loaded = PPO.load(tmp_path / "model.zip", env=make("HvacAttack", 2, adapter="expected", **SHORT))
    assert isinstance(loaded.rollout_buffer, ActiveBuffer)
    loaded.learn(1)
