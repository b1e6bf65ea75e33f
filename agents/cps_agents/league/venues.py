"""Where a response is looked for: the configuration, and how both roles see and act in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.league.meetings import RETURN
from cps_agents.league.oracles import Oracle
from cps_agents.league.strategy import Strategy
from cps_agents.learning.recipe import Recipe, changed
from cps_agents.zoo.references import FORMS, card_of, form_of
from cps_baselines.arena import Venue
from cps_envs import find_problem
from cps_envs.core.types import Role


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
