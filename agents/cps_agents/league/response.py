"""Best responses: policies that oracles find against one fixed, perhaps mixed strategy."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from cps_agents.arena.admission import admit
from cps_agents.arena.play import silent
from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError, explain
from cps_agents.league.meetings import play_table
from cps_agents.league.oracles import Oracle
from cps_agents.league.strategy import Strategy
from cps_agents.league.venues import decisions, forms_of
from cps_agents.learning.learner import train_all
from cps_agents.learning.recipe import SEARCH, SHARED, UNBOUNDED, Recipe, Situation, changed
from cps_agents.learning.run import TrainingJob
from cps_agents.progress import Progress
from cps_agents.workers import Where, Workers
from cps_agents.zoo.references import reference_to
from cps_baselines.family import find_family
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.declare.seeds import VALIDATION
from cps_envs.core.types import SIGN, FloatArray, Role, other

USUAL_S = 60.0  # CPU time of our own PPO and of all searches together, where nothing bounds them
WARM_UP = 4  # updates of the value alone, where learning begins with a trained network
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Question:
    """A strategy to respond to, the role that responds, and where."""

    role: Role
    strategy: Strategy
    venue: Venue
    episodes: int  # on validation seeds, which choose among what is found
    known: tuple[str, ...] = ()  # policies of the role; our own PPO goes on from the best network among them


@dataclass(frozen=True)
class Budget:
    """What each oracle may spend with each training seed."""

    seeds: int
    workers: Where
    command: str
    first_seed: int = 0
    steps: int | None = None  # decisions, those of searches included
    cpu_s: float | None = None
    resume: bool = False

    @property
    def training_seeds(self) -> range:
        """The seeds themselves."""
        return range(self.first_seed, self.first_seed + self.seeds)


@dataclass(frozen=True)
class Response:
    """What an oracle found with one training seed."""

    oracle: str
    seed: int
    reference: str
    steps: int
    cpu_s: float
    validation: float = 0.0  # the mean payoff to the role against the strategy, on validation seeds


@dataclass(frozen=True)
class Responses:
    """What all oracles found, and why some found nothing."""

    found: tuple[Response, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def chosen(self) -> Response:
        """The one that validation chooses."""
        return max(self.found, key=lambda each: each.validation)

    @property
    def steps(self) -> int:
        """Steps that all oracles and training seeds took."""
        return sum(each.steps for each in self.found)

    @property
    def cpu_s(self) -> float:
        """CPU seconds that all oracles and training seeds took."""
        return round(sum(each.cpu_s for each in self.found), 1)


def respond(
    oracles: Sequence[Oracle],
    question: Question,
    folder: Path,
    budget: Budget,
    store: Store,
    title: str,
    tell: Tell = silent,
) -> Responses:
    """Let all oracles respond, one after the other, and value what they find on validation seeds.

    An oracle that cannot play there is left out, and `tell` hears why.

    Raises:
        CommandError: no oracle has found anything.
    """
    found: list[Response] = []
    left_out: dict[str, str] = {}
    for oracle in oracles:
        try:
            found += _ask(oracle, question, folder / oracle.name, budget, store, f"{title}, {oracle.name}")
        except Exception as error:
            reason = explain(error)
            if reason is None:
                raise
            left_out[oracle.name] = reason
            tell(f"Left out: {oracle.name}: {reason}")
    if not found:
        reasons = "; ".join(f"{name}: {reason}" for name, reason in left_out.items())
        raise CommandError(f"no oracle of the {question.role} has found a response. {reasons}")
    payoffs = _validate([each.reference for each in found], question, store, budget.workers, title)
    return Responses(
        tuple(replace(each, validation=float(paid)) for each, paid in zip(found, payoffs, strict=True)), left_out
    )


def _ask(oracle: Oracle, question: Question, folder: Path, budget: Budget, store: Store, title: str) -> list[Response]:
    """The best that an oracle's recipes find with each training seed; they share its budget."""
    asked = [against(recipe, question, f"{recipe.name}-response") for recipe in oracle.recipes]
    recipes = _fitting(asked)
    home = {recipe.name: folder / recipe.name if len(asked) > 1 else folder for recipe in recipes}
    runs = []
    for recipe in recipes:
        if recipe.algorithm == SHARED:
            recipe = _warm(recipe, question, store, budget.workers, title)
        runs.append(limited(recipe, budget.steps, budget.cpu_s, len(recipes)))
    return _train(oracle.name, runs, home, budget, title)


def _fitting(recipes: Sequence[Recipe]) -> list[Recipe]:
    """Those whose policies can play where they are to be searched; a network is refused where it learns.

    Raises:
        CommandError: none can.
    """
    refusals = {
        recipe.name: admit(recipe.venue, recipe.role, Contestant(find_family(recipe.family).policy)).refusal
        for recipe in recipes
        if recipe.family
    }
    if refusals and len(refusals) == len(recipes) and all(refusals.values()):
        raise CommandError("; ".join(f"{name}: {reason}" for name, reason in refusals.items()))
    return [recipe for recipe in recipes if not refusals.get(recipe.name)]


def _warm(recipe: Recipe, question: Question, store: Store, workers: Where, title: str) -> Recipe:
    """The recipe beginning with the network, among the known policies, that is paid most; as it is if there is none."""
    from cps_agents.learning.warm_start import fits

    networks = [reference for reference in question.known if fits(reference, recipe)]
    if recipe.start or not networks:
        return recipe
    best = int(_validate(networks, question, store, workers, title).argmax())
    return changed(recipe, {"start": networks[best], "value_warm_up": WARM_UP})


def against(recipe: Recipe, question: Question, name: str) -> Recipe:
    """The recipe with this opponent, whose trained policies see and act as they have learned.

    Raises:
        CommandError: the opponent's policies were trained in forms that differ.
    """
    strategy = question.strategy
    recipe = replace(recipe, overrides={**recipe.overrides, **forms_of(strategy, question.venue)})
    scenes = (Situation(recipe.scenes[0].episodes),)  # all of them against the strategy
    return changed(replace(recipe, name=name, scenes=scenes), {"opponent": strategy.reference})


def limited(recipe: Recipe, steps: int | None, cpu_s: float | None = None, sharing: int = 1) -> Recipe:
    """The recipe with so many decisions and CPU seconds per seed, of which each of `sharing` recipes has its part."""
    if steps is None and (recipe.algorithm == SHARED or recipe.training.total_timesteps == UNBOUNDED):
        return changed(recipe, {"total_timesteps": UNBOUNDED, "most_cpu_s": float(cpu_s or USUAL_S) / sharing})
    timed = recipe if cpu_s is None else replace(recipe, most_cpu_s=float(cpu_s) / sharing)
    if steps is None:
        return timed
    per_step = decisions(recipe.venue, recipe.role) if recipe.algorithm == SEARCH else 1
    return changed(timed, {"total_timesteps": max(steps // (per_step * sharing), 1)})


def _train(
    name: str, recipes: Sequence[Recipe], home: Mapping[str, Path], budget: Budget, title: str
) -> list[Response]:
    """Train recipes with each training seed, or go on with that; of each seed the one that validation chooses.

    Raises:
        CommandError: see `cps_agents.learning.learner.learn`.
    """
    jobs = [
        TrainingJob(recipe, seed, home[recipe.name].resolve() / f"seed-{seed}", budget.command, resume=budget.resume)
        for seed in budget.training_seeds
        for recipe in recipes
    ]
    runs = list(zip(jobs, train_all(jobs, budget.workers, title), strict=True))
    found = []
    for seed in budget.training_seeds:
        mine = [(job, run) for job, run in runs if job.seed == seed]
        best, record = max(mine, key=lambda each: float(each[1]["best_score"]))
        steps = sum(int(run["steps"]) * _unit(job.recipe) for job, run in mine)
        cpu_s = round(sum(float(run["cpu_s"]) for _, run in mine), 1)
        found.append(Response(name, seed, record.get("policy", reference_to(best.folder)), steps, cpu_s))
    return found


def _unit(recipe: Recipe) -> int:
    """Decisions in a step of a recipe."""
    return decisions(recipe.venue, recipe.role) if recipe.algorithm == SEARCH else 1


def _validate(references: Sequence[str], question: Question, store: Store, workers: Where, title: str) -> FloatArray:
    """What the role's policies are paid against the strategy, (P,), the mean over validation seeds."""
    role, strategy = question.role, question.strategy
    sides = {role: list(map(Contestant, references)), other(role): list(map(Contestant, strategy.policies))}
    attackers, defenders = sides["attacker"], sides["defender"]
    table = Table(question.venue, attackers, defenders, question.episodes, first_seed=VALIDATION.start)
    with Progress(f"{title}, validation pairs", 1) as progress, Workers(workers) as pool:
        found = play_table(table, store, pool, progress.report).means
    paid: FloatArray = (found if role == "attacker" else found.T) @ np.array(strategy.probabilities)
    return SIGN[role] * paid
