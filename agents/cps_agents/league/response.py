"""Best responses: policies trained against one fixed, perhaps mixed strategy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cps_agents.errors import CommandError
from cps_agents.league.meetings import RETURN
from cps_agents.league.strategy import Strategy
from cps_agents.zoo.references import PREFIX, card_of, form_of
from cps_baselines.arena import Venue
from cps_envs import find_problem
from cps_envs.core.errors import require
from cps_envs.core.types import Role

if TYPE_CHECKING:
    from cps_agents.learning.recipe import Recipe


@dataclass(frozen=True)
class Budget:
    """How training is done; the same recipe once for each seed."""

    seeds: int
    workers: int
    command: str
    first_seed: int = 0
    resume: bool = False
    device: str = "cpu"


@dataclass(frozen=True)
class Trained:
    """The runs of a best response, by training seed."""

    references: Mapping[int, str]
    validation: Mapping[int, float]  # the mean payoff on validation seeds, the higher the better for the role
    steps: int  # of all seeds
    cpu_s: float

    @property
    def seed(self) -> int:
        """The one that validation chooses."""
        return max(self.validation, key=lambda seed: self.validation[seed])

    @property
    def reference(self) -> str:
        """The policy of that seed."""
        return self.references[self.seed]


def recipe_of(problem: str, role: Role, name: str | None = None) -> Recipe:
    """The recipe of a name, or else the usual one of the role.

    Raises:
        CommandError: no recipe has that name, or it is for another problem or role.
    """
    from cps_agents.recipes.finding import find_recipe, usual_recipe

    if name is None:
        return usual_recipe(problem, role)
    recipe = find_recipe(name)
    if (recipe.problem, recipe.role) != (problem, role):
        raise CommandError(f"the recipe {name!r} trains the {recipe.role} of {recipe.problem}, not the {role}")
    return recipe


def limited(recipe: Recipe, steps: int | None) -> Recipe:
    """The recipe with so many decisions per seed in all: of its search for plans and of its learning, in proportion."""
    from cps_agents.learning.recipe import changed

    if steps is None:
        return recipe
    searched = round(steps * recipe.search_steps / (recipe.search_steps + recipe.total_steps))
    return changed(recipe, {"search_steps": searched, "total_steps": max(steps - searched, 1)})


def differing_presets(recipe: Recipe, strategy: Strategy) -> list[str]:
    """The opponent's trained policies that learned in another preset than the recipe's."""
    cards = {name: card_of(name) for name in strategy.policies}
    return [f"{name} ({card.preset})" for name, card in cards.items() if card and card.preset != recipe.preset]


def against(recipe: Recipe, strategy: Strategy, **knobs: Any) -> Recipe:
    """The recipe with this opponent, whose trained policies see and act as they have learned; the payoff decides.

    Raises:
        CommandError: the opponent's policies have been trained in forms that differ.
    """
    from cps_agents.learning.recipe import changed

    config = find_problem(recipe.problem).config(recipe.preset, recipe.overrides)
    forms: dict[str, Any] = {}
    for policy in strategy.policies:
        forms = merged([forms, form_of(policy, config)], f"the opponent's {policy}")
    return changed(recipe, {"evaluation_metric": RETURN, **knobs, "opponent": strategy.reference, "overrides": forms})


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


def venue_of(recipe: Recipe) -> Venue:
    """The configuration that a recipe trains in."""
    return Venue(recipe.problem, recipe.preset, dict(recipe.overrides))


def respond(recipe: Recipe, folder: Path, budget: Budget, title: str) -> Trained:
    """Train a recipe on some seeds, or go on with that.

    Raises:
        MissingExtraError: what training needs is not installed.
        CommandError: see `cps_agents.learning.learner.learn`.
    """
    require("stable_baselines3", extra="train", purpose="training a best response")
    require("sb3_contrib", extra="train", purpose="training a best response")
    from cps_agents.learning.job import Job
    from cps_agents.learning.runs import train_all

    jobs = [
        Job(recipe, seed, folder.resolve() / f"seed-{seed}", budget.command, resume=budget.resume, device=budget.device)
        for seed in range(budget.first_seed, budget.first_seed + budget.seeds)
    ]
    found = train_all(jobs, budget.workers, title)
    return Trained(
        references={job.seed: f"{PREFIX}{job.folder}" for job in jobs},
        validation={job.seed: float(run["best_score"]) for job, run in zip(jobs, found, strict=True)},
        steps=sum(int(run["steps"]) for run in found),
        cpu_s=round(sum(float(run["cpu_s"]) for run in found), 1),
    )
