"""Tianshou's vector environments."""

from __future__ import annotations

import gymnasium
import numpy as np
from tianshou.env import DummyVectorEnv
from trying import PLAIN, attempt, each


def steps(env_id: str) -> None:
    envs = DummyVectorEnv([lambda: gymnasium.make(env_id)] * 2)
    envs.reset()
    envs.step(np.stack([envs.action_space[0].sample() for _ in range(2)]))


if __name__ == "__main__":
    attempt("`DummyVectorEnv` of all ids", each(steps, PLAIN))
