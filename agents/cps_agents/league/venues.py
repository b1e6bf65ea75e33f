"""Where a strategy is answered: the configuration, and how both roles see and act in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError
from cps_agents.league.strategy import Strategy
from cps_agents.learning.recipe import Recipe
from cps_agents.zoo.references import card_of, form_of
from cps_envs import find_problem
from cps_envs.core.declare.config import form_fields
from cps_envs.core.types import Role


def venue_against(strategy: Strategy, usual: Recipe, preset: str | None, overrides: Mapping[str, Any]) -> Venue:
    """Where a strategy is answered: as asked, or where its first trained policy learned, or in the usual recipe's."""
    cards = [card for card in map(card_of, strategy.policies) if card is not None]
    if preset is not None:
        return Venue(usual.problem, preset, dict(overrides))
    if cards:
        return Venue(usual.problem, cards[0].preset, {**cards[0].overrides, **overrides})
    return usual.venue.changed(overrides)


def form_of_recipe(recipe: Recipe, venue: Venue) -> dict[str, Any]:
    """The overrides that let a recipe's role see and act in a venue as the recipe has it; what the venue sets stays."""
    own, there = recipe.venue.config, venue.config
    names = [name for name in form_fields(own, recipe.role) if name not in venue.overrides]
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
    """The overrides of all of them together.

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


def decisions(venue: Venue, role: Role) -> int:
    """How often a role decides in an episode that lasts to its end."""
    game = find_problem(venue.problem).game(venue.config, 1)
    return int(-(-game.horizon // game.decision_interval[role]))
