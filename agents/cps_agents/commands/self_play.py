"""`cps-envs self-play`: double oracle over a problem."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.arena.store import Store
from cps_agents.arena.venue import Venue
from cps_agents.commands.options import (
    MEETINGS,
    AsJson,
    AtCluster,
    Attackers,
    BudgetS,
    Changes,
    Config,
    Defenders,
    Fresh,
    Jobs,
    Meetings,
    Oracles,
    Preset,
    Steps,
    conclude,
    described,
    kept,
    workers,
)
from cps_agents.console import assignments, err, note, out, print_json
from cps_agents.files import alone_in, write_figure, write_json
from cps_agents.league.bounds import LeagueOutcome, judge
from cps_agents.league.league import asked, check_anybody, line_up
from cps_agents.league.oracles import SEARCHES, Oracle, choose_oracles, in_venue
from cps_agents.league.response import Budget
from cps_agents.league.self_play import Iteration, Pool, SelfPlayGame, claim, iterate
from cps_agents.league.self_play_report import document, draw, play_line, strategy_line, table, tell_round
from cps_agents.league.venues import merged
from cps_agents.learning.recipe import SHARED
from cps_agents.machine import describe
from cps_agents.recipes.finding import usual_recipe
from cps_agents.workers import Workers
from cps_agents.zoo.references import form_of
from cps_envs import find_problem
from cps_envs.core.errors import require
from cps_envs.core.types import ROLES, Role


def self_play(
    problem: Annotated[str, typer.Argument(help="Problem, such as rogue.")],
    iterations: Annotated[int, typer.Option(min=1, help="Rounds in all; ask for more with --resume.")] = 3,
    attacker: Attackers = None,
    defender: Defenders = None,
    oracle: Oracles = None,
    preset: Preset = None,
    config: Config = None,
    overrides: Changes = None,
    knobs: Annotated[
        list[str] | None,
        typer.Option("--knob", metavar="NAME=VALUE", help="Change a knob of all recipes; may be repeated."),
    ] = None,
    steps: Steps = None,
    budget: BudgetS = None,
    seeds: Annotated[int, typer.Option(min=1, help="Training seeds of each response.")] = 1,
    episodes: Annotated[int, typer.Option(min=1, max=1_000_000, help="Episodes of each pair.")] = 50,
    folder: Annotated[Path, typer.Option("--out", help="Write runs and results to this folder.")] = Path("self-play"),
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    cluster: AtCluster = None,
    fresh: Fresh = False,
    resume: Annotated[bool, typer.Option("--resume", help="Continue from what is there.")] = False,
    as_json: AsJson = False,
) -> None:
    """Let both roles learn best responses in rounds, each against the equilibrium of all policies so far.

    It starts from the computed policies and the shipped trained ones. Our own PPO goes on from the best network that
    fits. Press Ctrl-C at any time: every finished pair, run and round is kept, and --resume continues.
    """
    require("matplotlib", extra="baselines", purpose="the figure of self-play")
    given = assignments(knobs or [], "--knob", "learning_rate=0.001")
    chosen, values = described(find_problem(problem), preset, config, overrides)
    venue, responding = _settings(problem, oracle or [], chosen, values, given)
    spent = Budget(seeds, workers(jobs, cluster), describe()["command"], 0, steps, budget)
    named: dict[Role, list[str]] = {"attacker": attacker or ["all"], "defender": defender or ["all"]}
    store = kept(meetings, fresh=fresh)
    with alone_in(folder):
        game = _game(venue, named, responding, episodes, spent, store)
        claim(folder, game, resume)
        outcome = _play(game, folder, store, iterations, spent)
    if as_json:
        print_json(_document(outcome))
    else:
        _show(outcome)
    conclude([folder / f"self-play.{suffix}" for suffix in ("json", "png")], store)


def _settings(
    problem: str, names: list[str], preset: str | None, values: Mapping[str, Any], knobs: Mapping[str, Any]
) -> tuple[Venue, dict[Role, list[Oracle]]]:
    """One configuration for all oracles: as asked, or what the recipes need together."""
    oracles = {role: choose_oracles(problem, role, names or (SHARED,)) for role in ROLES}
    recipes = [
        next((each.recipes[0] for each in oracles[role] if each.name != SEARCHES), usual_recipe(problem, role))
        for role in ROLES
    ]
    venue = Venue(problem, preset or merged([{"preset": each.preset} for each in recipes], "a recipe")["preset"])
    if preset is None:
        needed = [{name: each for name, each in recipe.overrides.items() if name not in values} for recipe in recipes]
        venue = venue.changed(merged(needed, "a recipe"))
    venue = venue.changed(values)
    return venue, {role: in_venue(oracles[role], venue, knobs, own_forms=False) for role in ROLES}


def _game(
    venue: Venue,
    references: dict[Role, list[str]],
    oracles: dict[Role, list[Oracle]],
    episodes: int,
    budget: Budget,
    store: Store,
) -> SelfPlayGame:
    """A self-play with those of the named policies that can play, observing and acting as the venue does."""
    with Workers(budget.workers) as pool:
        table, left_out = line_up(asked(venue, references, episodes), references, store, pool)
    for (role, reference), reason in left_out.items():
        note(f"Left out: {role} {reference}: {reason}")
    check_anybody(table, left_out)
    start: dict[Role, list[str]] = {role: [] for role in ROLES}
    for role in ROLES:
        for reference in (player.reference for player in table.players(role)):
            if reason := _unmixable(reference, venue):
                note(f"Left out: {role} {reference}: {reason}")
            else:
                start[role].append(reference)
    return SelfPlayGame(venue, start, oracles, episodes, budget.seeds, budget.steps, budget.cpu_s)


def _unmixable(reference: str, venue: Venue) -> str:
    """Why a mixed strategy cannot hold a policy; empty if it can."""
    form = form_of(reference, venue.config)
    return f"it was trained with other {', '.join(form)}; see --set" if form else ""


def _play(game: SelfPlayGame, folder: Path, store: Store, iterations: int, budget: Budget) -> LeagueOutcome:
    """Iterate; after each iteration the results are judged, told and written."""
    outcomes: list[LeagueOutcome] = []

    def report(pool: Pool, done: list[Iteration]) -> None:
        outcomes.append(judge(game, pool, done, store, budget.workers))
        err().print(tell_round(outcomes[-1]), markup=False)
        write_json(folder / "self-play.json", _document(outcomes[-1]))
        write_figure(folder / "self-play.png", draw(outcomes[-1]))

    iterate(game, folder, store, iterations, budget, report, note)
    return outcomes[-1]


def _document(outcome: LeagueOutcome) -> dict[str, Any]:
    return document(outcome, describe())


def _show(outcome: LeagueOutcome) -> None:
    console = out()
    console.print(table(outcome))
    for role in ROLES:
        console.print(strategy_line(outcome, role), markup=False, soft_wrap=True)
        console.print(play_line(outcome, role), markup=False, soft_wrap=True)
    console.print(f"Responses: {outcome.steps:,} steps, {outcome.cpu_s:.0f} CPU s.")
