"""Learners of stable-baselines3 and sb3-contrib, for a few steps."""

from __future__ import annotations

from typing import Any

import gymnasium
import pytest

import cps_envs  # noqa: F401  registers the environments

LEARNS = pytest.mark.slow  # tests/agents/test_sb3.py trains at every commit
sb3 = pytest.importorskip("stable_baselines3")
IDS = sorted(str(env_id) for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))


@pytest.mark.parametrize("env_id", IDS)
def test_checker(env_id: str) -> None:
    """`check_env` of all ids"""
    from stable_baselines3.common.env_checker import check_env

    check_env(gymnasium.make(env_id), skip_render_check=True)


@LEARNS
def test_workers() -> None:
    """PPO, workers by spawn"""
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import SubprocVecEnv

    spawn: dict[str, Any] = {"vec_env_cls": SubprocVecEnv, "vec_env_kwargs": {"start_method": "spawn"}}
    sb3.PPO("MlpPolicy", make_vec_env("cps_envs:cps_envs/RogueDefense-v0", 2, **spawn), n_steps=32).learn(64)


@LEARNS
def test_sac() -> None:
    """SAC"""
    native = gymnasium.make("cps_envs:cps_envs/RogueAttack-v0", interface="native")
    sb3.SAC("MlpPolicy", native, learning_starts=10).learn(30)


@LEARNS
@pytest.mark.parametrize("name", ["FdiAttack", "RogueDefense", "HvacDefense"])
def test_dqn(name: str) -> None:
    """DQN on FdiAttack, RogueDefense, HvacDefense, with flat actions"""
    env = gymnasium.make(f"cps_envs:cps_envs/{name}-v0", flat=True)
    sb3.DQN("MlpPolicy", env, learning_starts=10).learn(30)


@LEARNS
@pytest.mark.parametrize("interface", ["learning", "native"])
def test_masks(interface: str) -> None:
    """MaskablePPO on DisbandingAttack, in both interfaces"""
    contrib = pytest.importorskip("sb3_contrib")
    env = gymnasium.make("cps_envs/DisbandingAttack-v0", interface=interface)
    contrib.MaskablePPO("MlpPolicy", env, n_steps=32).learn(64)


@LEARNS
def test_native_vector() -> None:
    """PPO on the native vector environment

    Adapter: `cps_agents.sb3.as_sb3`
    """
    from cps_agents.sb3 import as_sb3

    envs: Any = gymnasium.make_vec("cps_envs:cps_envs/RogueAttack-v0", num_envs=8, autoreset="same_step")
    sb3.PPO("MlpPolicy", as_sb3(envs), n_steps=16, batch_size=64).learn(256)
