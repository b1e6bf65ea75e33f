"""Response oracles as data: what looks for a best response of a role, by searching numbers or plans, or by learning.

Where it looks is a venue: the configuration, and how both roles see and act in it. One search is work that any process
can do and that is kept once it is done.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cache
from typing import Any, ClassVar

import numpy as np

from cps_agents.arena.meeting import InVenue, Result
from cps_agents.contest.jobs import judge_in
from cps_agents.contest.search import Judge, run_search
from cps_agents.errors import CommandError
from cps_agents.league.meetings import RETURN
from cps_agents.league.strategy import Strategy
from cps_agents.learning.recipe import RECURRENT, SEARCH, Recipe, changed
from cps_agents.recipes.finding import RECIPES, find_recipe, usual_recipe
from cps_agents.zoo.references import FORMS, card_of, form_of
from cps_baselines.arena import Venue
from cps_baselines.contest import Search
from cps_baselines.family import FAMILIES, find_family
from cps_envs import find_problem
from cps_envs.core.documents import Entry
from cps_envs.core.errors import ConfigurationError, near, require
from cps_envs.core.types import FloatArray, Role


@dataclass(frozen=True)
class SearchJob(InVenue):
    """A policy of the role whose numbers are searched against one opponent."""

    kind: ClassVar[str] = "answer"
    role: Role
    opponent: str  # reference
    search: Search
    budget_s: float  # CPU time
    episodes: int  # of a candidate
    most_episodes: int  # of all candidates; 0: as many as the time allows
    first_seed: int
    sources: Mapping[str, str] = field(default_factory=dict)  # see `Meeting`

    @property
    def label(self) -> str:
        """For progress."""
        return self.search.name

    def run(self) -> Result:
        """What the search found: `policy`, `score`, `candidates`, `episodes`."""
        judge = judge_in(self.venue, self.role, (self.opponent,))
        forgiving = _forgiving(judge)
        found = run_search(self.search, forgiving, self.budget_s, self.episodes, self.first_seed, self.most_episodes)
        if found.score <= REFUSED:
            judge(found.policy, [self.first_seed])  # says why nobody can play
        return asdict(found)

    def check(self, result: Entry) -> None:
        """A reference with what it was paid and what it took."""
        result["policy"].text()
        result["score"].number()
        for name in ("candidates", "episodes", "cpu_s"):
            result[name].number(0)


REFUSED = -1e9  # the score of a candidate that cannot play


def _forgiving(judge: Judge) -> Judge:
    """A judge for whom the worst candidates are those that the configuration refuses: a platoon that is not there."""

    def judged(policy: str, seeds: Sequence[int]) -> FloatArray:
        try:
            return judge(policy, seeds)
        except ConfigurationError:
            return np.full(len(seeds), REFUSED)

    return judged


def venue_against(strategy: Strategy, usual: Recipe, preset: str | None, overrides: Mapping[str, Any]) -> Venue:
    """Where a strategy is answered: as asked, or where its first trained policy learned, or in the usual recipe's."""
    cards = [card for card in map(card_of, strategy.policies) if card is not None]
    if preset is not None:
        return Venue(usual.problem, preset, dict(overrides))
    if cards:
        return Venue(usual.problem, cards[0].preset, {**cards[0].overrides, **overrides})
    return venue_of(usual).changed(overrides)


def venue_of(recipe: Recipe) -> Venue:
    """The configuration that a recipe trains in."""
    return Venue(recipe.problem, recipe.preset, dict(recipe.overrides))


def form_of_recipe(recipe: Recipe, venue: Venue) -> dict[str, Any]:
    """The overrides that let a recipe's role see and act in a venue as the recipe has it; what the venue sets stays."""
    own, there = venue_of(recipe).config, venue.config
    names = [name for name in FORMS.get((recipe.problem, recipe.role), ()) if name not in venue.overrides]
    return {name: getattr(own, name) for name in names if getattr(own, name) != getattr(there, name)}


def forms_of(strategy: Strategy, venue: Venue) -> dict[str, Any]:
    """The overrides with which a strategy's trained policies see and act as they have learned.

    Raises:
        CommandError: they have been trained in forms that differ.
    """
    forms: dict[str, Any] = {}
    for policy in strategy.policies:
        forms = merged([forms, form_of(policy, venue.config)], f"the opponent's {policy}")
    return forms


def merged(overrides: Sequence[Mapping[str, Any]], whose: str) -> dict[str, Any]:
    """All overrides together.

    Raises:
        CommandError: two of them set a field differently.
    """
    found: dict[str, Any] = {}
    for part in overrides:
        for name, value in part.items():
            if name in found and found[name] != value:
                raise CommandError(
                    f"{whose} needs {name} = {value!r}, another policy {found[name]!r}: choose one with --set "
                    f"{name}=..., or leave one of them out"
                )
            found[name] = value
    return found


def in_venue(
    oracles: Sequence[Oracle], venue: Venue, knobs: Mapping[str, Any], *, own_forms: bool = True
) -> list[Oracle]:
    """The oracles, whose recipes train in a venue, are paid the return, and have the knobs that were asked for.

    Their role sees and acts as their recipes have it, or with `own_forms=False` as the venue has it.

    Raises:
        CommandError: no such knob.
    """

    def moved(recipe: Recipe) -> Recipe:
        form = form_of_recipe(recipe, venue) if own_forms else {}
        overrides = {**form, **venue.overrides}
        return changed(replace(recipe, preset=venue.preset, overrides=overrides, evaluation_metric=RETURN), knobs)

    return [oracle if oracle.recipe is None else replace(oracle, recipe=moved(oracle.recipe)) for oracle in oracles]


def other_presets(oracles: Sequence[Oracle], venue: Venue) -> list[str]:
    """The recipes that were made for another preset than the venue's, as `NAME (PRESET)`."""
    recipes = [oracle.recipe for oracle in oracles if oracle.recipe is not None]
    return [f"{recipe.name} ({recipe.preset})" for recipe in recipes if recipe.preset != venue.preset]


def decisions(venue: Venue, role: Role) -> int:
    """How often a role decides in an episode that lasts to its end."""
    game = find_problem(venue.problem).game(venue.config, 1)
    return int(-(-game.horizon // game.decision_interval[role]))


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
    return (found.problem, found.role) == (problem, role) and bool(found.free.all())


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
