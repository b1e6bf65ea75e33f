"""Response oracles as data: what looks for a best response of a role. The usual one is our own PPO.

A search for the numbers of hand-made policies is another one, and any recipe by its name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from cps_agents.arena.table import RETURN
from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError
from cps_agents.league.venues import form_of_recipe
from cps_agents.learning.recipe import SEARCH, SHARED, UNBOUNDED, Recipe, changed
from cps_agents.recipes.finding import RECIPES, find_recipe, usual_recipe
from cps_baselines.family import families
from cps_envs.core.errors import near, require
from cps_envs.core.types import Role

SEARCHES = "search"
KINDS = (SHARED, SEARCHES)


@dataclass(frozen=True)
class Oracle:
    """One way to look for a response: recipes that share its budget, of which validation chooses the best."""

    name: str  # its own, in tables and as a folder
    recipes: tuple[Recipe, ...]


def choose_oracles(problem: str, role: Role, names: Sequence[str] = (SHARED,)) -> list[Oracle]:
    """The oracles of these names: `shared-ppo`, `search`, or recipes.

    A recipe's name is for its own role; the other role has no oracle of that name.

    Raises:
        CommandError: a name that neither an oracle nor a recipe has, a recipe of another problem, or nothing to search.
        MissingExtraError: what an oracle needs is not installed.
    """
    found = [oracle for name in dict.fromkeys(names) if (oracle := _named(name, problem, role)) is not None]
    if not found:
        remedy = f"{SHARED} is there for all roles, {SEARCHES} where a family has bounds (cps_baselines.family)"
        raise CommandError(f"the {role} of {problem} has no oracle {', '.join(names)}: {remedy}")
    for oracle in found:
        _check_installed(oracle)
    return found


def in_venue(
    oracles: Sequence[Oracle], venue: Venue, knobs: Mapping[str, Any], *, own_forms: bool = True
) -> list[Oracle]:
    """The oracles, whose recipes train in a venue, are paid the return, and have the knobs that were asked for.

    Their role sees and acts as their recipes have it, or with `own_forms=False` as the venue has it.

    Raises:
        CommandError: no such knob.
    """

    def moved(oracle: Oracle, recipe: Recipe) -> Recipe:
        form = form_of_recipe(recipe, venue) if own_forms and oracle.name != SEARCHES else {}
        overrides = {**form, **venue.overrides}
        return changed(replace(recipe, preset=venue.preset, overrides=overrides, evaluation_metric=RETURN), knobs)

    return [replace(oracle, recipes=tuple(moved(oracle, each) for each in oracle.recipes)) for oracle in oracles]


def _named(name: str, problem: str, role: Role) -> Oracle | None:
    if name == SHARED:
        return Oracle(SHARED, (usual_recipe(problem, role),))
    if name == SEARCHES:
        searches = tuple(search_of(problem, role, name) for name in bounded_families(problem, role))
        return Oracle(SEARCHES, searches) if searches else None
    if name not in RECIPES and not any(part in name for part in ("Attack", "Defense", ":")):
        raise CommandError(f"there is no oracle and no recipe {name!r}. {near(name, [*KINDS, *RECIPES])}")
    recipe = find_recipe(name)
    if recipe.problem != problem:
        raise CommandError(f"the recipe {name!r} trains the {recipe.role} of {recipe.problem}, not one of {problem}")
    return Oracle(recipe.name, (recipe,)) if recipe.role == role else None


def bounded_families(problem: str, role: Role) -> list[str]:
    """The families of a role whose numbers all have bounds."""
    return [name for name, each in families(problem).items() if each.role == role and each.is_bounded]


def search_of(problem: str, role: Role, family: str) -> Recipe:
    """The recipe by which a family is searched for a response."""
    name = family.rpartition(":")[2].lower()
    recipe = Recipe(name=name, problem=problem, role=role, algorithm=SEARCH, family=family)
    return changed(recipe, {"total_timesteps": UNBOUNDED, "population": 8, "evaluations": 4})  # CPU time ends it


def _check_installed(oracle: Oracle) -> None:
    if any(recipe.algorithm == SEARCH for recipe in oracle.recipes):
        require("cma", extra="baselines", purpose="searching responses")
    else:
        require("torch", extra="train", purpose="training a best response")
