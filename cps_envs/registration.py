"""One table of problems, registered with Gymnasium and PettingZoo when the package is imported."""

from __future__ import annotations

from cps_envs.core import registration as core
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.problem import Problem
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


def register() -> None:
    """Register every id that is not registered yet."""
    for problem in PROBLEMS.values():
        core.register(problem, f"cps_envs.{problem.name}_v{problem.version}")
