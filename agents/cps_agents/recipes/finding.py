"""The recipes by name and by environment."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pkgutil import iter_modules

from cps_agents import recipes
from cps_agents.errors import CommandError
from cps_agents.learning.recipe import SEARCH, Recipe
from cps_agents.recipes.learning import learning_recipe
from cps_envs.core.errors import near
from cps_envs.core.problem import Problem
from cps_envs.core.trust import require_trust
from cps_envs.core.types import ROLES, Role
from cps_envs.registration import PROBLEMS, find_problem


def _declared() -> Iterator[Recipe]:
    """Our own PPO for every role, then one of each class of recipes in this package."""
    for problem in PROBLEMS.values():
        yield from (learning_recipe(problem, role) for role in ROLES)
    for module in iter_modules(recipes.__path__, f"{recipes.__name__}."):
        for found in vars(import_module(module.name)).values():
            if isinstance(found, type) and issubclass(found, Recipe) and found.__module__ == module.name:
                yield found()


RECIPES: dict[str, Recipe] = {recipe.name: recipe for recipe in _declared()}


def find_recipe(name: str, algorithm: str | None = None) -> Recipe:
    """The recipe of a name, or of an environment id such as `cps_envs/HvacAttack-v0`: our own PPO, or a policy search.

    An id with its module, such as `own_problem:own_problem/TankAttack-v0`, names an environment of your own.

    Raises:
        CommandError: there is none.
        UntrustedCodeError: it names code of your own, and the user has not agreed to run it.
    """
    if name in RECIPES:
        return RECIPES[name]
    short = name.removeprefix("cps_envs:")
    ids = {problem.env_id(role): (problem.name, role) for problem in PROBLEMS.values() for role in ROLES}
    for env_id, place in ids.items():
        if short in (env_id, env_id.removeprefix("cps_envs/")):
            return usual_recipe(*place, algorithm)
    module, colon, env_id = short.partition(":")
    for reference, problem in _problems_of(module) if colon else ():
        for role in ROLES:
            if problem.env_id(role) == env_id:
                return usual_recipe(reference, role, algorithm)
    raise CommandError(
        f"there is no recipe and no environment {name!r}. {near(name, [*RECIPES, *ids])} "
        "One of your own is written MODULE:NAMESPACE/NameAttack-v0."
    )


def usual_recipe(problem: str, role: Role, algorithm: str | None = None) -> Recipe:
    """The usual recipe of a role: our own PPO, or a policy search. The problem is a name or a reference."""
    found = learning_recipe(find_problem(problem), role, problem)
    if algorithm != SEARCH:
        return found
    return Recipe(name=f"{found.name}-search", problem=problem, role=role, algorithm=SEARCH)


def _problems_of(module: str) -> list[tuple[str, Problem]]:
    """The problems that a module of the user's declares, as `module:attribute`."""
    require_trust(module)
    try:
        found = vars(import_module(module))
    except (ImportError, ValueError) as error:
        raise CommandError(f"no environment can be imported from {module!r}: {error}") from error
    return [(f"{module}:{name}", each) for name, each in found.items() if isinstance(each, Problem)]
