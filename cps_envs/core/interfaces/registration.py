"""Registering a problem with Gymnasium and PettingZoo: by names alone, so that importing it loads no kernels."""

from __future__ import annotations

import gymnasium
import pettingzoo

from cps_envs.core.game.problem import Problem
from cps_envs.core.types import ROLES, Role


def class_name(problem: Problem, role: Role) -> str:
    """Name of a role's environment class without the suffix `Env` or `VectorEnv`, such as `HvacAttack`."""
    return problem.env_id(role).rpartition("/")[2].partition("-")[0]


def register(problem: Problem, module: str) -> None:
    """Register the ids of a problem, whose forms are in this module, with Gymnasium and PettingZoo, once."""
    for role in ROLES:
        name, env_id = class_name(problem, role), problem.env_id(role)
        if env_id not in gymnasium.registry:
            gymnasium.register(
                id=env_id, entry_point=f"{module}:{name}Env", vector_entry_point=f"{module}:{name}VectorEnv"
            )
    both = f"{problem.namespace}/{problem.name}-v{problem.version}"  # PettingZoo reads "..._v0" as the same id
    if both not in getattr(pettingzoo, "parallel_registry", {both}):  # PettingZoo has had a registry since 1.27
        pettingzoo.register("parallel", both, entry_point=f"{module}:parallel_env")
        pettingzoo.register("aec", both, entry_point=f"{module}:env")
