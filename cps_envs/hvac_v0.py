"""PettingZoo's view of the HVAC problem: `parallel_env()` and `env()`."""

from cps_envs.hvac.envs import env, parallel_env

__all__ = ["env", "parallel_env"]
