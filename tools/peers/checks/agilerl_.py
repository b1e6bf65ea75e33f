"""AgileRL's asynchronous PettingZoo vector."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from agilerl.vector.pz_async_vec_env import AsyncPettingZooVecEnv
from pettingzoo import ParallelEnv
from pettingzoo.utils import BaseParallelWrapper
from trying import attempt

from cps_envs import hvac_v0, rogue_v0

RESHAPED = "a PettingZoo wrapper that reshapes actions: AgileRL's workers squeeze an action of shape (1,) to a scalar"


class Reshaped(BaseParallelWrapper):
    """Gives each action the shape of its space again."""

    def step(self, actions: dict[str, Any]) -> Any:
        """Take a step with the reshaped actions."""
        shaped = {agent: np.reshape(action, self.action_space(agent).shape) for agent, action in actions.items()}
        return super().step(shaped)


def reshaped(**options: Any) -> ParallelEnv:
    return Reshaped(rogue_v0.parallel_env(**options))


def steps(made: Callable[..., ParallelEnv]) -> None:
    envs = AsyncPettingZooVecEnv([partial(made, preset="learning")] * 2)
    envs.reset(seed=0)
    for _ in range(3):
        envs.step({agent: [envs.single_action_space(agent).sample() for _ in range(2)] for agent in envs.agents})
    envs.close()


if __name__ == "__main__":
    attempt("`AsyncPettingZooVecEnv` of the HVAC duel", partial(steps, hvac_v0.parallel_env))
    attempt("`AsyncPettingZooVecEnv` of the rogue duel", partial(steps, reshaped), RESHAPED)
