"""PettingZoo's view of the disbanding problem: `parallel_env()`, `env()` and the decentralised `swarm_env()`."""

from cps_envs.disbanding.envs import env, parallel_env, swarm_env

__all__ = ["env", "parallel_env", "swarm_env"]
