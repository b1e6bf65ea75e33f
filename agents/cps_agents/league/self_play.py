"""Double oracle: a growing game in which both roles answer the other's equilibrium strategy by training.

Each iteration solves the matrix of all policies there are, trains a best response of each role to the other's mixed
strategy, and adds both (policy-space response oracles: Lanctot et al. 2017; double oracle: McMahan et al. 2003). The
strategies are made on validation seeds; evaluation seeds only judge.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cps_agents.arena.store import Store
from cps_agents.console import to_json
from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.league.equilibrium import solve
from cps_agents.league.meetings import Payoffs, play_meetings
from cps_agents.league.response import Budget, Trained, against, respond
from cps_agents.league.strategy import Strategy, mix
from cps_agents.learning.seeds import EVALUATION, VALIDATION
from cps_agents.progress import Progress
from cps_baselines.arena import Contestant, Venue
from cps_baselines.workers import Workers
from cps_envs.core.documents import Entry, read_entry
from cps_envs.core.types import ROLES, FloatArray, Role, other

if TYPE_CHECKING:
    from cps_agents.learning.recipe import Recipe

MOST_STEPS, MOST_DIGITS = 10**15, 15  # in a file: of training, and of a seed
Pool = dict[Role, list[Contestant]]
Profile = Mapping[Role, Strategy]


@dataclass(frozen=True)
class Game:
    """What is played and how responses are trained."""

    venue: Venue
    start: Mapping[Role, Sequence[str]]  # references of the policies to begin with
    recipes: Mapping[Role, Recipe]  # in the venue's configuration
    episodes: int  # of each pair, on validation seeds and again on evaluation seeds
    seeds: int  # training seeds of each response

    def to_json(self) -> dict[str, Any]:
        """As plain data: what a run that goes on must have in common with what is there."""
        plain = {**asdict(self), "recipes": {role: asdict(recipe) for role, recipe in self.recipes.items()}}
        found: dict[str, Any] = json.loads(to_json(plain))
        return found


@dataclass(frozen=True)
class Iteration:
    """A profile of mixed strategies, and what training found against it."""

    number: int
    profile: Profile
    responses: Mapping[Role, Trained]


def claim(folder: Path, game: Game, resume: bool) -> None:
    """Begin in an empty folder, or go on with the same game.

    Raises:
        CommandError: something is there already, or of another game.
        DamagedFileError: what is there is damaged.
    """
    path = folder / "game.json"
    mine = game.to_json()
    if not path.is_file():
        write_json(path, mine)
        return
    found = _read(path).plain()
    differing = sorted(name for name in mine if found.get(name) != mine[name])
    if differing:
        raise CommandError(
            f"{folder} holds self-play of another game (other: {', '.join(differing)}). Choose another --out, or "
            "delete it."
        )
    if not resume:
        raise CommandError(f"{folder} holds self-play already: continue with --resume, or choose another --out")


def iterate(
    game: Game,
    folder: Path,
    store: Store,
    iterations: int,
    budget: Budget,
    after: Callable[[Pool, list[Iteration]], None],
) -> None:
    """Do the iterations that are not done yet; `after` is called with the pool and all iterations after each.

    What is finished, runs, pairs and plans, is kept at once: interrupted at any point, a later call goes on there.
    """
    pool = starting_pool(game)
    done: list[Iteration] = []
    for number in range(iterations):
        home = folder / f"iteration-{number + 1}"
        known = _load(home, number)
        iteration = known or _iterate(game, pool, number, store, home, budget)
        done.append(iteration)
        pool = _grown(pool, iteration)
        if known is None or number == iterations - 1:
            after(pool, done)


def starting_pool(game: Game) -> Pool:
    """The policies to begin with."""
    return {role: [Contestant(name) for name in game.start[role]] for role in ROLES}


def _grown(pool: Pool, iteration: Iteration) -> Pool:
    """With the responses that are not there yet."""
    new = {role: Contestant(f"response {iteration.number + 1}", iteration.responses[role].reference) for role in ROLES}
    return {
        role: [*pool[role], *([new[role]] if all(new[role].reference != each.reference for each in pool[role]) else [])]
        for role in ROLES
    }


def play_pool(game: Game, pool: Pool, seeds: range, store: Store, workers: int, title: str) -> Payoffs:
    """The matrix of all pairs, of which only new ones are played."""
    with Progress(title, 1) as progress, Workers(workers) as workplace:
        return play_meetings(
            game.venue,
            pool["attacker"],
            pool["defender"],
            seeds,
            store=store,
            pool=workplace,
            report=progress.report,
        )


def play_validation(game: Game, pool: Pool, store: Store, workers: int) -> Payoffs:
    """The matrix on which strategies are made."""
    seeds = range(VALIDATION.start, VALIDATION.start + game.episodes)
    return play_pool(game, pool, seeds, store, workers, "validation pairs")


def play_evaluation(game: Game, pool: Pool, store: Store, workers: int) -> Payoffs:
    """The matrix that judges."""
    seeds = range(EVALUATION.start, EVALUATION.start + game.episodes)
    return play_pool(game, pool, seeds, store, workers, "evaluation pairs")


def equilibrium_profile(pool: Pool, payoff: FloatArray) -> Profile:
    """The mixed strategies of the equilibrium of a matrix (m, n)."""
    found = solve(payoff)
    shares: dict[Role, FloatArray] = {"attacker": found.attacker, "defender": found.defender}
    return {role: mix([player.reference for player in pool[role]], shares[role].tolist()) for role in ROLES}


def _iterate(game: Game, pool: Pool, number: int, store: Store, home: Path, budget: Budget) -> Iteration:
    profile = _plan(game, pool, store, home, budget.workers)
    own = replace(budget, seeds=game.seeds, first_seed=number * game.seeds, resume=True)
    responses: dict[Role, Trained] = {}
    for role in ROLES:
        recipe = game.recipes[role]
        tuned = against(recipe, profile[other(role)], name=f"{recipe.name}-response-{number + 1}")
        responses[role] = respond(tuned, home / role, own, f"iteration {number + 1}, {role}")
    iteration = Iteration(number, profile, responses)
    plain = {
        "responses": {role: asdict(found) for role, found in responses.items()},
        "profile": {role: asdict(found) for role, found in profile.items()},
    }
    write_json(home / "result.json", plain)
    return iteration


def _plan(game: Game, pool: Pool, store: Store, home: Path, workers: int) -> Profile:
    """The profile to respond to; once made it stays, whatever is played again later."""
    path = home / "plan.json"
    if path.is_file():
        return _profile(_read(path))
    profile = equilibrium_profile(pool, play_validation(game, pool, store, workers).means)
    write_json(path, {role: asdict(found) for role, found in profile.items()})
    return profile


def _load(home: Path, number: int) -> Iteration | None:
    path = home / "result.json"
    if not path.is_file():
        return None
    found = _read(path)
    responses = {role: _trained(found["responses"][role]) for role in ROLES}
    return Iteration(number, _profile(found["profile"]), responses)


def _profile(found: Entry) -> Profile:
    return {role: _strategy(found[role]) for role in ROLES}


def _strategy(found: Entry) -> Strategy:
    policies = [each.text() for each in found["policies"].rows()]
    probabilities = [each.number(0, 1) for each in found["probabilities"].rows()]
    try:
        return Strategy(tuple(policies), tuple(probabilities))
    except ValueError as error:
        raise found.source.error(error) from error


def _trained(found: Entry) -> Trained:
    references = {_seed(seed, each): each.text() for seed, each in found["references"].entries().items()}
    validation = {_seed(seed, each): each.number() for seed, each in found["validation"].entries().items()}
    if not references or references.keys() != validation.keys():
        raise found["references"].error("a policy for each seed that was validated")
    steps, cpu_s = found["steps"].whole(0, MOST_STEPS), found["cpu_s"].number(0)
    return Trained(references, validation, steps, cpu_s)


def _seed(name: str, entry: Entry) -> int:
    if not (name.isdecimal() and len(name) <= MOST_DIGITS):
        raise entry.source.error(f"{entry.place}: {name!r} is no training seed")
    return int(name)


def _read(path: Path) -> Entry:
    return read_entry(path, "file of self-play", "Delete it and go on with --resume.")
