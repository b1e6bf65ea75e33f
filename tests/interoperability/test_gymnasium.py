"""Gymnasium's checker, wrappers, asynchronous vectors and films."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import NormalizeObservation, NormalizeReward, RecordEpisodeStatistics, RecordVideo

import cps_envs  # noqa: F401  registers the environments

IDS = sorted(str(env_id) for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))
SHORT = {"Rogue": {"duration_s": 3.0}, "Disbanding": {"duration_s": 20.0}}


def made(env_id: str) -> Any:
    options: dict[str, Any] = next((kwargs for name, kwargs in SHORT.items() if name in env_id), {})
    return gymnasium.make(env_id, **options)


@pytest.mark.slow  # tests/test_conformance.py calls it, too
@pytest.mark.parametrize("env_id", IDS)
def test_checker(env_id: str) -> None:
    """`check_env` of all ids, without a display"""
    check_env(made(env_id).unwrapped)


@pytest.mark.parametrize("env_id", IDS)
def test_wrappers(env_id: str) -> None:
    """RecordEpisodeStatistics, NormalizeObservation, NormalizeReward"""
    env: Any = NormalizeReward(NormalizeObservation(RecordEpisodeStatistics(made(env_id))))
    env.reset(seed=0)
    for _ in range(5):
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()


def test_film(tmp_path: Path) -> None:
    """RecordVideo (extra `video`)"""
    pytest.importorskip("moviepy")
    plain: Any = gymnasium.make("cps_envs/RogueAttack-v0", render_mode="rgb_array", duration_s=2.0)
    env = RecordVideo(plain, str(tmp_path), disable_logger=True)
    env.reset(seed=0)
    ended = False
    while not ended:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        ended = bool(terminated or truncated)
    env.close()
    assert list(tmp_path.glob("*.mp4"))


def test_asynchronous_vector() -> None:
    """AsyncVectorEnv with spawn"""
    made = partial(gymnasium.make, "cps_envs:cps_envs/HvacAttack-v0")
    envs: Any = gymnasium.vector.AsyncVectorEnv([made] * 2, context="spawn")
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    envs.close()
