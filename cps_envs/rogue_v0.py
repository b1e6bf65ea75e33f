"""PettingZoo's view of the rogue-vehicle problem: `parallel_env()`, `env()` and the decentralised `swarm_env()`."""

from cps_envs.rogue.envs import env, parallel_env, swarm_env

__all__ = ["env", "parallel_env", "swarm_env"]
