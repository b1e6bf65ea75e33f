"""One table of problems, registered with Gymnasium and PettingZoo when the package is imported."""

from __future__ import annotations

from importlib import import_module

from cps_envs.core import registration as core
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.problem import Problem
from cps_envs.core.trust import require_trust
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.fdi.problem import FDI
from cps_envs.hvac.problem import HVAC
from cps_envs.rogue.problem import ROGUE

PROBLEMS: dict[str, Problem] = {problem.name: problem for problem in (DISBANDING, FDI, HVAC, ROGUE)}


def find_problem(name: str) -> Problem:
    """The problem of a name such as "disbanding", or the one at `"module:attribute"`, such as your own.

    Raises:
        UnknownNameError: there is none; the message names the near ones.
        UntrustedCodeError: `module:attribute` without the user's consent, see `cps_envs.trust`.
    """
    module, colon, attribute = name.partition(":")
    if name in PROBLEMS:
        return PROBLEMS[name]
    if not colon:
        raise UnknownNameError(f"there is no problem {name!r}. {near(name, PROBLEMS)}")
    if not module.startswith("cps_envs."):  # importing our own modules does no harm, and nothing is called
        require_trust(name)
    try:
        found = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownNameError(f"no problem can be imported from {name!r}: {error}") from error
    if not isinstance(found, Problem):
        raise UnknownNameError(f"{name!r} is no problem but {found!r}")
    return found


def register() -> None:
    """Register every id that is not registered yet."""
    for problem in PROBLEMS.values():
        core.register(problem, f"cps_envs.{problem.name}_v{problem.version}")
