"""PettingZoo's view of the false-data-injection problem: `parallel_env()` and `env()`."""

from cps_envs.fdi.envs import env, parallel_env

__all__ = ["env", "parallel_env"]
