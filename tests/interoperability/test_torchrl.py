"""TorchRL's own wrappers and checks."""

from __future__ import annotations

from importlib import import_module

import gymnasium
import numpy as np
import pytest

import cps_envs  # noqa: F401

pytest.importorskip("torchrl")

from torchrl.envs import GymEnv, PettingZooWrapper
from torchrl.envs.utils import check_env_specs

# TorchRL reads a MultiDiscrete of one entry as a number, which NumPy 2.4 refuses to convert: two attacked sensors.
OPTIONS = {"cps_envs/FdiAttack-v0": {"attacked": "xv4"}}
IDS = sorted(env_id for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))


@pytest.mark.parametrize("env_id", IDS)
def test_single_environments(env_id: str) -> None:
    env = GymEnv(env_id, **OPTIONS.get(env_id, {}))
    check_env_specs(env)
    reward = env.rollout(5)["next", "reward"]
    assert np.isfinite(reward.numpy()).all()


@pytest.mark.parametrize("name", ["disbanding", "fdi", "hvac", "rogue"])
def test_duels(name: str) -> None:
    env = PettingZooWrapper(import_module(f"cps_envs.{name}_v0").parallel_env(), use_mask=True)
    check_env_specs(env)
