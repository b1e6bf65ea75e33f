"""The recipes by name and by environment."""

from __future__ import annotations

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import Recipe
from cps_agents.recipes.disbanding_attack import DisbandingAttack
from cps_agents.recipes.disbanding_defense import DisbandingDefense, DisbandingDefenseLocal
from cps_agents.recipes.disbanding_search import DisbandingDefenseLocalSearch, DisbandingDefenseSearch
from cps_agents.recipes.fdi_attack import FdiAttack, FdiAttackDisturbed
from cps_agents.recipes.fdi_defense import FdiDefense
from cps_agents.recipes.hvac_attack import HvacAttack, HvacAttackMtd1
from cps_agents.recipes.hvac_defense import HvacDefense
from cps_agents.recipes.hvac_search import HvacAttackMtd2Search, HvacAttackSearch, HvacDefenseSearch
from cps_agents.recipes.rogue_attack import RogueAttack, RogueAttackRecurrent
from cps_agents.recipes.rogue_defense import RogueDefense
from cps_envs.core.errors import near
from cps_envs.registration import PROBLEMS

RECIPES: dict[str, Recipe] = {
    recipe.name: recipe
    for recipe in (
        DisbandingAttack(),
        DisbandingDefense(),
        DisbandingDefenseLocal(),
        DisbandingDefenseSearch(),
        DisbandingDefenseLocalSearch(),
        FdiAttack(),
        FdiAttackDisturbed(),
        FdiDefense(),
        HvacAttack(),
        HvacAttackMtd1(),
        HvacAttackSearch(),
        HvacAttackMtd2Search(),
        HvacDefense(),
        HvacDefenseSearch(),
        RogueAttack(),
        RogueAttackRecurrent(),
        RogueDefense(),
    )
}


def find_recipe(name: str) -> Recipe:
    """The recipe of a name, or the first one of an environment id such as `cps_envs/HvacAttack-v0`.

    Raises:
        CommandError: there is none.
    """
    if name in RECIPES:
        return RECIPES[name]
    short = name.removeprefix("cps_envs:")
    for recipe in RECIPES.values():
        if short in (full := PROBLEMS[recipe.problem].env_id(recipe.role), full.removeprefix("cps_envs/")):
            return recipe
    ids = [problem.env_id(role) for problem in PROBLEMS.values() for role in ("attacker", "defender")]
    raise CommandError(f"there is no recipe and no environment {name!r}. {near(name, [*RECIPES, *ids])}")
