"""Vectors and wrappers of Tianshou, AgileRL and RLlib: a reset and a few steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from pettingzoo.utils import BaseParallelWrapper

from cps_envs import hvac_v0, rogue_v0

IDS = sorted(str(env_id) for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))


@pytest.mark.parametrize("env_id", IDS)
def test_tianshou(env_id: str) -> None:
    """`DummyVectorEnv` of all ids"""
    envs = pytest.importorskip("tianshou.env").DummyVectorEnv([partial(gymnasium.make, env_id)] * 2)
    envs.reset()
    envs.step(np.stack([envs.action_space[0].sample() for _ in range(2)]))


class Reshaped(BaseParallelWrapper):
    """Gives each action the shape of its space again."""

    def step(self, actions: dict[str, Any]) -> Any:
        """Take a step with the reshaped actions."""
        shaped = {agent: np.reshape(action, self.action_space(agent).shape) for agent, action in actions.items()}
        return super().step(shaped)


def reshaped(**options: Any) -> Any:
    return Reshaped(rogue_v0.parallel_env(**options))


def steps(made: Callable[..., Any]) -> None:
    vectors = pytest.importorskip("agilerl.vector.pz_async_vec_env")
    envs = vectors.AsyncPettingZooVecEnv([partial(made, preset="learning")] * 2)
    envs.reset(seed=0)
    for _ in range(3):
        envs.step({agent: [envs.single_action_space(agent).sample() for _ in range(2)] for agent in envs.agents})
    envs.close()


def test_agilerl() -> None:
    """`AsyncPettingZooVecEnv` of the HVAC duel"""
    steps(hvac_v0.parallel_env)


def test_agilerl_reshaped() -> None:
    """`AsyncPettingZooVecEnv` of the rogue duel

    Adapter: a PettingZoo wrapper that reshapes actions: AgileRL's workers squeeze an action of shape (1,) to a scalar
    """
    steps(reshaped)


def test_rllib() -> None:
    """`ParallelPettingZooEnv` of the rogue duel: reset and a step"""
    wrappers = pytest.importorskip("ray.rllib.env.wrappers.pettingzoo_env")
    env = wrappers.ParallelPettingZooEnv(rogue_v0.parallel_env(preset="learning"))
    env.reset(seed=0)
    env.step({agent: env.action_space[agent].sample() for agent in env.get_agent_ids()})
