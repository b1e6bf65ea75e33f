"""AgileRL's asynchronous PettingZoo vector."""

from __future__ import annotations

from functools import partial

from agilerl.vector.pz_async_vec_env import AsyncPettingZooVecEnv
from trying import attempt

from cps_envs import rogue_v0


def steps() -> None:
    envs = AsyncPettingZooVecEnv([partial(rogue_v0.parallel_env, preset="learning")] * 2)
    envs.reset(seed=0)
    envs.step({agent: [envs.single_action_space(agent).sample() for _ in range(2)] for agent in envs.agents})
    envs.close()


if __name__ == "__main__":
    attempt("`AsyncPettingZooVecEnv` of the rogue duel", steps)
