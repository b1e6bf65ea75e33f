"""Gymnasium's checker, wrappers, asynchronous vectors and films."""

from __future__ import annotations

from pathlib import Path

import gymnasium
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import NormalizeObservation, NormalizeReward, RecordEpisodeStatistics, RecordVideo
from trying import IDS, PLAIN, attempt, each

SHORT = {"Rogue": {"duration_s": 3.0}, "Disbanding": {"duration_s": 20.0}}


def options(env_id: str) -> dict[str, float]:
    """Arguments for short episodes."""
    return next((kwargs for name, kwargs in SHORT.items() if name in env_id), {})


def checker(env_id: str) -> None:
    check_env(gymnasium.make(env_id, **options(env_id)).unwrapped)


def wrappers(env_id: str) -> None:
    env = NormalizeReward(NormalizeObservation(RecordEpisodeStatistics(gymnasium.make(env_id, **options(env_id)))))
    env.reset(seed=0)
    for _ in range(5):
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()


def film(env_id: str) -> None:
    env = RecordVideo(gymnasium.make(env_id, render_mode="rgb_array", duration_s=2.0), "videos", disable_logger=True)
    env.reset(seed=0)
    ended = False
    while not ended:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        ended = terminated or truncated
    env.close()
    assert list(Path("videos").glob("*.mp4"))


def spawned() -> None:
    envs = gymnasium.vector.AsyncVectorEnv(
        [lambda: gymnasium.make("cps_envs:cps_envs/HvacAttack-v0")] * 2, context="spawn"
    )
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    envs.close()


if __name__ == "__main__":
    attempt("`check_env` of all ids, without a display", each(checker, IDS))
    attempt("RecordEpisodeStatistics, NormalizeObservation, NormalizeReward", each(wrappers, PLAIN))
    attempt("RecordVideo (extra `video`)", lambda: film("cps_envs/RogueAttack-v0"))
    attempt("AsyncVectorEnv with spawn", spawned)
