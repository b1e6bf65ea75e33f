"""Double oracle: a growing game in which both roles respond to the other's equilibrium strategy.

Each iteration solves the matrix of all policies there are, lets the response oracles of each role respond to the
other's mixed strategy, and adds what validation chooses (policy-space response oracles: Lanctot et al. 2017; double
oracle: McMahan et al. 2003). The strategies are made on validation seeds; evaluation seeds only judge.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from cps_agents.arena.play import silent
from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_agents.console import to_json
from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.league.equilibrium import solve
from cps_agents.league.meetings import Payoffs, play_table
from cps_agents.league.oracles import Oracle
from cps_agents.league.response import Budget, Question, Response, Responses, Tell, respond
from cps_agents.league.strategy import Strategy, mix
from cps_agents.progress import Progress
from cps_agents.workers import Where, Workers
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.declare.seeds import VALIDATION
from cps_envs.core.documents import Entry, read_entry
from cps_envs.core.types import ROLES, FloatArray, Role, other

MOST_STEPS = 10**15  # in a file: of training, and of a seed
Pool = dict[Role, list[Contestant]]
Profile = Mapping[Role, Strategy]


@dataclass(frozen=True)
class SelfPlayGame:
    """What is played and how responses are found."""

    venue: Venue
    start: Mapping[Role, Sequence[str]]  # references of the policies to begin with
    oracles: Mapping[Role, Sequence[Oracle]]  # in the venue's configuration
    episodes: int  # of each pair, on validation seeds and again on evaluation seeds
    seeds: int  # training seeds of each response
    steps: int | None = None  # of each oracle and seed
    cpu_s: float | None = None

    def to_json(self) -> dict[str, Any]:
        """The game as plain data: a run that is resumed must have the same."""
        oracles = {role: [asdict(oracle) for oracle in chosen] for role, chosen in self.oracles.items()}
        found: dict[str, Any] = json.loads(to_json({**asdict(self), "oracles": oracles}))
        return found


@dataclass(frozen=True)
class Iteration:
    """A profile of mixed strategies, and what the oracles found against it."""

    number: int
    profile: Profile
    responses: Mapping[Role, Responses]


def claim(folder: Path, game: SelfPlayGame, resume: bool) -> None:
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
    game: SelfPlayGame,
    folder: Path,
    store: Store,
    iterations: int,
    budget: Budget,
    after: Callable[[Pool, list[Iteration]], None],
    tell: Tell = silent,
) -> None:
    """Do the iterations that are not done yet; `after` is called with the pool and all iterations after each.

    `tell` hears which oracles are left out.

    What is finished, runs, pairs and plans, is kept at once: interrupted at any point, a later call goes on there.
    """
    pool = starting_pool(game)
    done: list[Iteration] = []
    for number in range(iterations):
        home = folder / f"iteration-{number + 1}"
        known = _load(home, number)
        iteration = known or _iterate(game, pool, number, store, home, budget, tell)
        done.append(iteration)
        pool = _grown(pool, iteration)
        if known is None or number == iterations - 1:
            after(pool, done)


def starting_pool(game: SelfPlayGame) -> Pool:
    """The policies to begin with."""
    return {role: [Contestant(name) for name in game.start[role]] for role in ROLES}


def _grown(pool: Pool, iteration: Iteration) -> Pool:
    """The pool of policies, with the responses that are not in it yet."""
    name = f"response {iteration.number + 1}"
    new = {role: Contestant(name, iteration.responses[role].chosen.reference) for role in ROLES}
    return {
        role: [*pool[role], *([new[role]] if all(new[role].reference != each.reference for each in pool[role]) else [])]
        for role in ROLES
    }


def play_pool(game: SelfPlayGame, pool: Pool, seeds: range, store: Store, workers: Where) -> Payoffs:
    """The matrix of all pairs on the seeds that make strategies, or on those that judge; only new pairs are played."""
    title = "validation pairs" if seeds == VALIDATION else "evaluation pairs"
    table = Table(game.venue, pool["attacker"], pool["defender"], game.episodes, first_seed=seeds.start)
    with Progress(title, 1) as progress, Workers(workers) as workplace:
        return play_table(table, store, workplace, progress.report)


def equilibrium_profile(pool: Pool, payoff: FloatArray) -> Profile:
    """The mixed strategies of the equilibrium of a matrix (m, n)."""
    found = solve(payoff)
    shares: dict[Role, FloatArray] = {"attacker": found.attacker, "defender": found.defender}
    return {role: mix([player.reference for player in pool[role]], shares[role].tolist()) for role in ROLES}


def _iterate(
    game: SelfPlayGame, pool: Pool, number: int, store: Store, home: Path, budget: Budget, tell: Tell
) -> Iteration:
    profile = _plan(game, pool, store, home, budget.workers)
    own = replace(budget, seeds=game.seeds, first_seed=number * game.seeds, resume=True)
    responses: dict[Role, Responses] = {}
    for role in ROLES:
        known = tuple(player.reference for player in pool[role])
        question = Question(role, profile[other(role)], game.venue, game.episodes, known)
        title = f"round {number + 1}, {role}"
        responses[role] = respond(game.oracles[role], question, home / role, own, store, title, tell)
    iteration = Iteration(number, profile, responses)
    plain = {
        "responses": {role: asdict(found) for role, found in responses.items()},
        "profile": {role: asdict(found) for role, found in profile.items()},
    }
    write_json(home / "result.json", plain)
    return iteration


def _plan(game: SelfPlayGame, pool: Pool, store: Store, home: Path, workers: Where) -> Profile:
    """The profile to respond to; once made it stays, whatever is played again later."""
    path = home / "plan.json"
    if path.is_file():
        return _profile(_read(path))
    profile = equilibrium_profile(pool, play_pool(game, pool, VALIDATION, store, workers).means)
    write_json(path, {role: asdict(found) for role, found in profile.items()})
    return profile


def _load(home: Path, number: int) -> Iteration | None:
    path = home / "result.json"
    if not path.is_file():
        return None
    found = _read(path)
    responses = {role: _responses(found["responses"][role]) for role in ROLES}
    return Iteration(number, _profile(found["profile"]), responses)


def _profile(found: Entry) -> Profile:
    return {role: _strategy_in(found[role]) for role in ROLES}


def _strategy_in(found: Entry) -> Strategy:
    """A strategy as a file of self-play has it.

    Raises:
        DamagedFileError: it is none.
    """
    policies = [each.text() for each in found["policies"].rows()]
    probabilities = [each.number(0, 1) for each in found["probabilities"].rows()]
    try:
        return Strategy(tuple(policies), tuple(probabilities))
    except ValueError as error:
        raise found.source.error(error) from error


def _responses(found: Entry) -> Responses:
    kept = tuple(_response(each) for each in found["found"].rows())
    if not kept:
        raise found["found"].error("at least one response")
    return Responses(kept, {name: each.text() for name, each in found["left_out"].entries().items()})


def _response(found: Entry) -> Response:
    return Response(
        oracle=found["oracle"].text(),
        seed=found["seed"].whole(0, MOST_STEPS),
        reference=found["reference"].text(),
        steps=found["steps"].whole(0, MOST_STEPS),
        cpu_s=found["cpu_s"].number(0),
        validation=found["validation"].number(),
    )


def _read(path: Path) -> Entry:
    return read_entry(path, "file of self-play", "Delete it and go on with --resume.")
