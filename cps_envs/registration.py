"""One table of problems, registered with Gymnasium and PettingZoo when the package is imported."""

from __future__ import annotations

import gymnasium
import pettingzoo

from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.problem import Problem
from cps_envs.core.types import ROLES, Role
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.fdi.problem import FDI
from cps_envs.hvac.problem import HVAC
from cps_envs.rogue.problem import ROGUE

PROBLEMS: dict[str, Problem] = {problem.name: problem for problem in (DISBANDING, FDI, HVAC, ROGUE)}


def find_problem(name: str) -> Problem:
    """The problem of a name such as "disbanding".

    Raises:
        UnknownNameError: there is none; the message names the near ones.
    """
    if name not in PROBLEMS:
        raise UnknownNameError(f"there is no problem {name!r}. {near(name, PROBLEMS)}")
    return PROBLEMS[name]


def class_name(problem: Problem, role: Role) -> str:
    """Name of a role's environment class in the problem's module `envs`, without the suffix `Env` or `VectorEnv`."""
    return problem.env_id(role).removeprefix("cps_envs/").partition("-")[0]


def register() -> None:
    """Register every id that is not registered yet."""
    for problem in PROBLEMS.values():
        module = f"cps_envs.{problem.name}.envs"
        for role in ROLES:
            name = class_name(problem, role)
            if problem.env_id(role) not in gymnasium.registry:
                gymnasium.register(
                    id=problem.env_id(role),
                    entry_point=f"{module}:{name}Env",
                    vector_entry_point=f"{module}:{name}VectorEnv",
                )
        duel = f"cps_envs/{problem.name}-v{problem.version}"  # PettingZoo reads "..._v0" as the same id
        if duel not in pettingzoo.parallel_registry:
            pettingzoo.register("parallel", duel, entry_point=f"{module}:parallel_env")
            pettingzoo.register("aec", duel, entry_point=f"{module}:env")
