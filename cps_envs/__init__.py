"""Attackers and defenders of cyber-physical systems as Gymnasium and PettingZoo environments.

Importing this package registers its environments, so `gymnasium.make("cps_envs:cps_envs/DisbandingAttack-v0")` works
anywhere.
"""

from importlib.metadata import PackageNotFoundError, version

from cps_envs.core.policies.trust import trust
from cps_envs.registration import PROBLEMS, find_problem, learning_env, register

try:
    __version__ = version("cps-envs")
except PackageNotFoundError:  # running from a source tree that is not installed
    __version__ = "0+unknown"

register()

__all__ = ["PROBLEMS", "__version__", "find_problem", "learning_env", "register", "trust"]
