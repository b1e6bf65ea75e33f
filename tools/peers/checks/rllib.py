"""RLlib on the rogue duel."""

from __future__ import annotations

from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from trying import attempt

from cps_envs import rogue_v0


def steps() -> None:
    env = ParallelPettingZooEnv(rogue_v0.parallel_env(preset="learning"))
    env.reset(seed=0)
    env.step({agent: env.action_space[agent].sample() for agent in env.get_agent_ids()})


if __name__ == "__main__":
    attempt("`ParallelPettingZooEnv` of the rogue duel: reset and a step", steps)
