"""The recipes by name and by environment."""

from __future__ import annotations

from importlib import import_module

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import SHARED, Recipe
from cps_agents.recipes.disbanding import (
    CaccBroadcast,
    CaccLocal,
    CaccRadio,
    CaccRobots,
    DisbandingAttack,
    DisbandingDefense,
)
from cps_agents.recipes.fdi import (
    FdiAttack,
    FdiAttackDisturbed,
    FdiDefense,
    FdiHypotheses,
    FdiTaskTracker,
)
from cps_agents.recipes.hvac import (
    HvacAttack,
    HvacBayes,
    HvacDefense,
    HvacWarmTracker,
)
from cps_agents.recipes.learning import learning_recipe
from cps_agents.recipes.rogue import (
    RogueAttack,
    RogueAttackRecurrent,
    RogueBoxIn,
    RogueDefense,
)
from cps_envs.core.errors import near
from cps_envs.core.problem import Problem
from cps_envs.core.trust import require_trust
from cps_envs.core.types import ROLES, Role
from cps_envs.registration import PROBLEMS, find_problem

RECIPES: dict[str, Recipe] = {
    recipe.name: recipe
    for recipe in (
        DisbandingAttack(),
        DisbandingDefense(),
        CaccBroadcast(),
        CaccLocal(),
        CaccRadio(),
        CaccRobots(),
        FdiAttack(),
        FdiAttackDisturbed(),
        FdiTaskTracker(),
        FdiDefense(),
        FdiHypotheses(),
        HvacAttack(),
        HvacWarmTracker(),
        HvacDefense(),
        HvacBayes(),
        RogueAttack(),
        RogueAttackRecurrent(),
        RogueDefense(),
        RogueBoxIn(),
        *(learning_recipe(problem, role) for problem in PROBLEMS.values() for role in ROLES),
    )
}


def find_recipe(name: str, algorithm: str | None = None) -> Recipe:
    """The recipe of a name, or that of an environment id such as `cps_envs/HvacAttack-v0` on preset `learning`.

    With another `algorithm` than that recipe's, an id means the first recipe of the environment, of any preset. An id
    with its module, such as `own_problem:own_problem/TankAttack-v0`, names an environment of your own.

    Raises:
        CommandError: there is none.
        UntrustedCodeError: it names code of your own, and the user has not agreed to run it.
    """
    if name in RECIPES:
        return RECIPES[name]
    short = name.removeprefix("cps_envs:")
    for recipe in sorted(
        RECIPES.values(), key=lambda each: (each.algorithm == SHARED) != (algorithm in (None, SHARED))
    ):
        if short in (full := PROBLEMS[recipe.problem].env_id(recipe.role), full.removeprefix("cps_envs/")):
            return recipe
    module, colon, env_id = short.partition(":")
    for reference, problem in _problems_of(module) if colon else ():
        for role in ROLES:
            if problem.env_id(role) == env_id:
                return usual_recipe(reference, role)
    ids = [problem.env_id(role) for problem in PROBLEMS.values() for role in ROLES]
    raise CommandError(
        f"there is no recipe and no environment {name!r}. {near(name, [*RECIPES, *ids])} "
        "One of your own is written MODULE:NAMESPACE/NameAttack-v0."
    )


def usual_recipe(problem: str, role: Role) -> Recipe:
    """The first recipe of a problem and role, or else one with the usual knobs."""
    name = find_problem(problem).name
    declared = (recipe for recipe in RECIPES.values() if (recipe.problem, recipe.role) == (problem, role))
    return next(declared, Recipe(name=f"{name}-{role}-ppo", problem=problem, role=role))


def _problems_of(module: str) -> list[tuple[str, Problem]]:
    """The problems that a module of the user's declares, as `module:attribute`."""
    require_trust(module)
    try:
        found = vars(import_module(module))
    except (ImportError, ValueError) as error:
        raise CommandError(f"no environment can be imported from {module!r}: {error}") from error
    return [(f"{module}:{name}", each) for name, each in found.items() if isinstance(each, Problem)]
