"""The recipes by name and by environment."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import SEARCH, Recipe
from cps_agents.recipes.learning import learning_recipe
from cps_envs.core.errors import near
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.trust import require_trust
from cps_envs.core.types import ROLES, Role
from cps_envs.registration import PROBLEMS, find_problem

RECIPES: Mapping[str, Recipe] = {  # our own PPO for every role
    recipe.name: recipe for recipe in (learning_recipe(each, role) for each in PROBLEMS.values() for role in ROLES)
}


def find_recipe(name: str, algorithm: str | None = None) -> Recipe:
    """The recipe of a name, or of an environment id such as `cps_envs/HvacAttack-v0`: our own PPO, or a policy search.

    An id with its module, such as `own_problem:own_problem/TankAttack-v0`, names an environment of your own, and
    `MODULE:CLASS` a recipe: a subclass of `Recipe` whose fields have defaults.

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
    module, colon, last = short.partition(":")
    own = _names_of(module) if colon else {}
    if isinstance(found := own.get(last), type) and issubclass(found, Recipe):
        return found()
    problems = {held: each for held, each in own.items() if isinstance(each, Problem)}
    mine = {each.env_id(role): (f"{module}:{held}", role) for held, each in problems.items() for role in ROLES}
    if last in mine:
        return usual_recipe(*mine[last], algorithm)
    known = [f"{module}:{env_id}" for env_id in mine] or [*RECIPES, *ids]
    raise CommandError(
        f"there is no recipe and no environment {name!r}. {near(name, known)} "
        "One of your own is written MODULE:CLASS or MODULE:NAMESPACE/NameAttack-v0."
    )


def usual_recipe(problem: str, role: Role, algorithm: str | None = None) -> Recipe:
    """The usual recipe of a role: our own PPO, or a policy search. The problem is a name or a reference."""
    found = learning_recipe(find_problem(problem), role, problem)
    if algorithm != SEARCH:
        return found
    return Recipe(name=f"{found.name}-search", problem=problem, role=role, algorithm=SEARCH)


def _names_of(module: str) -> Mapping[str, Any]:
    """What a module of the user's holds."""
    require_trust(module)
    try:
        return vars(import_module(module))
    except (ImportError, ValueError) as error:
        raise CommandError(f"nothing can be imported from {module!r}: {error}") from error
