"""Best responses: policies that oracles find against one fixed, perhaps mixed strategy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from cps_agents.arena.admission import admit
from cps_agents.arena.play import finish_all, silent
from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.errors import CommandError, explain
from cps_agents.league.meetings import play_table
from cps_agents.league.oracles import Oracle
from cps_agents.league.search import SearchJob
from cps_agents.league.strategy import Strategy
from cps_agents.league.venues import decisions, forms_of
from cps_agents.learning.learner import train_all
from cps_agents.learning.recipe import SEARCH, SHARED, UNBOUNDED, Recipe, Situation
from cps_agents.learning.run import TrainingJob
from cps_agents.progress import Progress
from cps_agents.zoo.references import PREFIX, origin_of
from cps_baselines.arena import Contestant, Venue
from cps_baselines.searches import SearchSpace
from cps_baselines.workers import Workers
from cps_envs.core.declare.seeds import TRAINING_START, VALIDATION
from cps_envs.core.types import SIGN, FloatArray, Role, other

SEARCH_START = TRAINING_START + 90_000_000  # seeds that no training run plays
SEARCH_SEEDS = 1_000_000  # of each training seed
SEARCH_EPISODES = 16  # of a candidate
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
    workers: int
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
    if oracle.recipe is None:
        return list(_search(oracle, question, budget, store, title))
    recipe = against(oracle.recipe, question, f"{oracle.recipe.name}-response")
    if recipe.algorithm == SHARED:
        recipe = _warm(recipe, question, store, budget.workers, title)
    return _train(oracle.name, limited(recipe, budget.steps, budget.cpu_s), folder, budget, title)


def _warm(recipe: Recipe, question: Question, store: Store, workers: int, title: str) -> Recipe:
    """The recipe beginning with the network, among the known policies, that is paid most; as it is if there is none."""
    from cps_agents.learning.warm_start import fits

    networks = [reference for reference in question.known if fits(reference, recipe)]
    if recipe.start or not networks:
        return recipe
    best = int(_validate(networks, question, store, workers, title).argmax())
    return replace(recipe, start=networks[best], value_warm_up=WARM_UP)


def against(recipe: Recipe, question: Question, name: str) -> Recipe:
    """The recipe with this opponent, whose trained policies see and act as they have learned.

    Raises:
        CommandError: the opponent's policies were trained in forms that differ.
    """
    strategy = question.strategy
    recipe = replace(recipe, overrides={**recipe.overrides, **forms_of(strategy, question.venue)})
    scenes = (Situation(recipe.scenes[0].episodes),)  # all of them against the strategy
    return replace(recipe, name=name, opponent=strategy.reference, scenes=scenes)


def limited(recipe: Recipe, steps: int | None, cpu_s: float | None = None) -> Recipe:
    """The recipe with so many decisions and CPU seconds per seed."""
    if recipe.algorithm == SHARED and steps is None:
        return replace(recipe, total_steps=UNBOUNDED, most_cpu_s=float(cpu_s or USUAL_S))
    timed = recipe if cpu_s is None else replace(recipe, most_cpu_s=float(cpu_s))
    if steps is None:
        return timed
    per_step = decisions(recipe.venue, recipe.role) if recipe.algorithm == SEARCH else 1
    return replace(timed, total_steps=max(steps // per_step, 1))


def _search(oracle: Oracle, question: Question, budget: Budget, store: Store, title: str) -> Iterator[Response]:
    """The best of the searches with each training seed; they share its budget."""
    venue = question.venue.changed(forms_of(question.strategy, question.venue))
    opponent = question.strategy.reference
    searches = _fitting(oracle, question.role, venue)
    count, per_episode = len(searches), decisions(venue, question.role)
    sources = origin_of(venue.problem, opponent).sources
    jobs = [
        SearchJob(
            venue,
            question.role,
            opponent,
            search,
            budget_s=(budget.cpu_s or USUAL_S) / count,
            episodes=SEARCH_EPISODES,
            most_episodes=0 if budget.steps is None else max(budget.steps // (per_episode * count), 1),
            first_seed=SEARCH_START + seed * SEARCH_SEEDS,
            sources=sources,
        )
        for seed in budget.training_seeds
        for search in searches
    ]
    results = {}
    with Progress(title, len(jobs)) as progress, Workers(min(budget.workers, len(jobs))) as pool:
        for job, result, _ in finish_all(jobs, store, pool):
            results[jobs.index(job)] = result
            progress.update(len(results), f"{job.label}: {result['score']:.4g}")
    for place, seed in enumerate(budget.training_seeds):
        mine = [results[place * count + k] for k in range(count)]
        best = max(mine, key=lambda each: each["score"])
        steps, cpu_s = (sum(each[name] for each in mine) for name in ("episodes", "cpu_s"))
        yield Response(oracle.name, seed, best["policy"], steps * per_episode, round(cpu_s, 1))


def _fitting(oracle: Oracle, role: Role, venue: Venue) -> list[SearchSpace]:
    """The searches of an oracle whose policy can play a venue.

    Raises:
        CommandError: none can.
    """
    refusals = {search.name: admit(venue, role, Contestant(search.policy)).refusal for search in oracle.searches}
    if all(refusals.values()):
        raise CommandError("; ".join(f"{name}: {reason}" for name, reason in refusals.items()))
    return [search for search in oracle.searches if not refusals[search.name]]


def _train(name: str, recipe: Recipe, folder: Path, budget: Budget, title: str) -> list[Response]:
    """Train a recipe with each training seed, or go on with that.

    Raises:
        CommandError: see `cps_agents.learning.learner.learn`.
    """
    jobs = [
        TrainingJob(recipe, seed, folder.resolve() / f"seed-{seed}", budget.command, resume=budget.resume)
        for seed in budget.training_seeds
    ]
    runs = train_all(jobs, budget.workers, title)
    unit = decisions(recipe.venue, recipe.role) if recipe.algorithm == SEARCH else 1  # of its steps
    return [
        Response(name, job.seed, f"{PREFIX}{job.folder}", int(run["steps"]) * unit, float(run["cpu_s"]))
        for job, run in zip(jobs, runs, strict=True)
    ]


def _validate(references: Sequence[str], question: Question, store: Store, workers: int, title: str) -> FloatArray:
    """What the role's policies are paid against the strategy, (P,), the mean over validation seeds."""
    role, strategy = question.role, question.strategy
    sides = {role: list(map(Contestant, references)), other(role): list(map(Contestant, strategy.policies))}
    attackers, defenders = sides["attacker"], sides["defender"]
    table = Table(question.venue, attackers, defenders, question.episodes, first_seed=VALIDATION.start)
    with Progress(f"{title}, validation pairs", 1) as progress, Workers(workers) as pool:
        found = play_table(table, store, pool, progress.report).means
    paid: FloatArray = (found if role == "attacker" else found.T) @ np.array(strategy.probabilities)
    return SIGN[role] * paid
