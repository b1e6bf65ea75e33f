"""Response oracles as data: what looks for a best response of a role, by searching numbers or plans, or by learning."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache

from cps_agents.errors import CommandError
from cps_agents.learning.recipe import RECURRENT, SEARCH, Recipe
from cps_agents.recipes.finding import RECIPES, find_recipe, usual_recipe
from cps_baselines.contest import Search
from cps_baselines.family import FAMILIES, find_family
from cps_envs.core.errors import near, require
from cps_envs.core.types import Role

USUAL = ("search", SEARCH, "plans", "ppo")  # what runs where nobody chooses
KINDS = (*USUAL, "recurrent")


@dataclass(frozen=True)
class Oracle:
    """One way to look for a response: the searches of the problem's contest, or a recipe."""

    kind: str  # of `KINDS`, or empty for a recipe that was named
    name: str  # its own, in tables and as a folder
    recipe: Recipe | None = None
    searches: tuple[Search, ...] = ()


def choose_oracles(problem: str, role: Role, names: Sequence[str] = ()) -> list[Oracle]:
    """The oracles with these names, kinds or names of recipes; by default all usual ones that the role has.

    A recipe's name is for its own role; the other role has no oracle of that name.

    Raises:
        CommandError: a name that neither a kind nor a recipe has, a recipe of another problem, or a kind that the role
            has not.
        MissingExtraError: what a named oracle needs is not installed.
    """
    present = oracles_of(problem, role)
    if not names:
        return [oracle for oracle in present if oracle.kind in USUAL]
    found = [oracle for name in dict.fromkeys(names) for oracle in _named(name, problem, role, present)]
    if not found:
        kinds = ", ".join(dict.fromkeys(oracle.kind for oracle in present))
        raise CommandError(f"the {role} of {problem} has no oracle {', '.join(names)}. It has: {kinds}.")
    for oracle in found:
        check_installed(oracle)
    return found


def check_installed(oracle: Oracle) -> None:
    """That the packages of an oracle are there.

    Raises:
        MissingExtraError: one is not; the message gives the command that installs it.
    """
    if oracle.recipe is None or oracle.recipe.algorithm == SEARCH:
        require("cma", extra="baselines", purpose="searching responses")
        return
    for package in ("stable_baselines3", "sb3_contrib"):
        require(package, extra="train", purpose="training a best response")


def oracles_of(problem: str, role: Role) -> list[Oracle]:
    """Every oracle of a role, the cheapest first."""
    return [*_searching(problem, role), *_families(problem, role), *_learning(problem, role)]


def _named(name: str, problem: str, role: Role, present: Sequence[Oracle]) -> Iterator[Oracle]:
    if name in KINDS:
        yield from (oracle for oracle in present if oracle.kind == name)
        return
    if name not in RECIPES and "Attack" not in name and "Defense" not in name:
        raise CommandError(f"there is no oracle and no recipe {name!r}. {near(name, [*KINDS, *RECIPES])}")
    recipe = find_recipe(name)
    if recipe.problem != problem:
        raise CommandError(f"the recipe {name!r} trains the {recipe.role} of {recipe.problem}, not one of {problem}")
    if recipe.role == role:
        yield Oracle("", recipe.name, recipe)


def _searching(problem: str, role: Role) -> Iterator[Oracle]:
    from cps_agents.contest.contest import declared_contest

    contest = declared_contest(problem)
    side = None if contest is None else contest.attackers if role == "attacker" else contest.defenders
    if side is not None and side.searches:
        yield Oracle("search", "search", searches=side.searches)


def _families(problem: str, role: Role) -> Iterator[Oracle]:
    recipes = {recipe.family: recipe for recipe in RECIPES.values() if recipe.algorithm == SEARCH}
    for name in FAMILIES:
        if _plays(name, problem, role):
            usual = Recipe(problem=problem, role=role, algorithm=SEARCH, family=name)
            yield Oracle(SEARCH, name, _plain(recipes.get(name, usual)))


@cache
def _plays(family: str, problem: str, role: Role) -> bool:
    found = find_family(family)
    return (found.problem, found.role) == (problem, role)


def _plain(recipe: Recipe) -> Recipe:
    """The knobs of a search, without what the recipe of a subclass finds worth more than its payoff."""
    knobs = {entry.name: getattr(recipe, entry.name) for entry in fields(Recipe)}
    return replace(Recipe(**knobs), name=recipe.family, scenes=Recipe().scenes)


def _learning(problem: str, role: Role) -> Iterator[Oracle]:
    """By plans, by reward and by imitation with a memory: the first recipe of each, without what the others do."""
    mine = [recipe for recipe in RECIPES.values() if (recipe.problem, recipe.role) == (problem, role)]
    for recipe in mine:
        if recipe.search_steps:
            yield Oracle("plans", "plans", replace(recipe, total_steps=1, self_imitation=0))
            break
    by_reward = (recipe for recipe in mine if recipe.algorithm in ("ppo", "maskable-ppo"))
    first = next(by_reward, None) or (usual_recipe(problem, role) if not mine else None)
    if first is not None:
        yield Oracle("ppo", "ppo", replace(first, search_steps=0, self_imitation=0))
    for recipe in mine:
        if recipe.algorithm in RECURRENT:
            yield Oracle("recurrent", "recurrent", recipe)
            break


def usual_of(oracles: Sequence[Oracle], problem: str, role: Role) -> Recipe:
    """The recipe whose configuration counts where nothing else says one: the first that learns, or the role's usual."""
    learning = (oracle.recipe for oracle in oracles if oracle.recipe is not None and oracle.kind != SEARCH)
    return next(learning, None) or usual_recipe(problem, role)
