"""`cps-envs self-play`: double oracle over a problem."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.commands.league import NAMES
from cps_agents.commands.options import MEETINGS, AsJson, Jobs, Meetings
from cps_agents.console import assignments, err, out, print_json

if TYPE_CHECKING:
    from cps_agents.arena.store import Store
    from cps_agents.league.bounds import Outcome
    from cps_agents.league.response import Budget
    from cps_agents.league.self_play import Game, Iteration, Pool
    from cps_agents.learning.recipe import Recipe
    from cps_baselines.arena import Venue
    from cps_envs.core.types import Role

RECIPE = "Recipe (see `cps-envs train --list`); default: the role's."


def self_play(
    problem: Annotated[str, typer.Argument(help="Problem, such as rogue.")],
    iterations: Annotated[int, typer.Option(min=1, help="Iterations in all; ask for more with --resume.")] = 5,
    attackers: Annotated[list[str] | None, typer.Option("--attackers", metavar="NAME", help=NAMES)] = None,
    defenders: Annotated[list[str] | None, typer.Option("--defenders", metavar="NAME", help=NAMES)] = None,
    attacker_recipe: Annotated[str | None, typer.Option(help=RECIPE)] = None,
    defender_recipe: Annotated[str | None, typer.Option(help=RECIPE)] = None,
    preset: Annotated[str | None, typer.Option(help="Preset of the environment; default: that of the recipes.")] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated."),
    ] = None,
    knobs: Annotated[
        list[str] | None,
        typer.Option("--knob", metavar="NAME=VALUE", help="Change a knob; may be repeated."),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(min=1, help="Decisions of each run, rounded up to whole updates.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Training seeds of each response.")] = 1,
    episodes: Annotated[int, typer.Option(min=1, max=1_000_000, help="Episodes of each pair.")] = 50,
    folder: Annotated[Path, typer.Option("--out", help="Write runs and results to this folder.")] = Path("self-play"),
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue from what is there.")] = False,
    device: Annotated[str, typer.Option(help="Device: cpu, cuda or auto.")] = "cpu",
    as_json: AsJson = False,
) -> None:
    """Train both roles in turn, each against the equilibrium of all policies so far.

    It starts from the computed policies and the shipped trained ones. Press Ctrl-C at any time: every finished pair,
    run and iteration is kept, and --resume continues.
    """
    from cps_agents.arena.store import Store
    from cps_agents.league.response import Budget, limited
    from cps_agents.league.self_play import claim
    from cps_agents.locking import alone_in
    from cps_agents.machine import available_cores, describe
    from cps_envs.core.errors import require

    for package in ("stable_baselines3", "sb3_contrib"):
        require(package, extra="train", purpose="self-play")
    require("matplotlib", extra="baselines", purpose="the figure of self-play")
    names: dict[Role, str | None] = {"attacker": attacker_recipe, "defender": defender_recipe}
    values = assignments(overrides or [])
    given: dict[str, Any] = {**assignments(knobs or [], "--knob", "learning_rate=0.001")}
    venue, recipes = _settings(problem, names, preset, values, given)
    recipes = {role: limited(recipe, steps) for role, recipe in recipes.items()}
    budget = Budget(seeds, jobs or available_cores(), describe()["command"], device=device)
    chosen: dict[Role, list[str]] = {"attacker": attackers or ["all"], "defender": defenders or ["all"]}
    store = Store(meetings)
    with alone_in(folder):
        game = _game(venue, chosen, recipes, episodes, budget, store)
        claim(folder, game, resume)
        outcome = _play(game, folder, store, iterations, budget)
    if as_json:
        print_json(_document(outcome))
    else:
        _show(outcome)
    written = ", ".join(str(folder / f"self-play.{suffix}") for suffix in ("json", "png"))
    err().print(f"Written: {written}", soft_wrap=True)


def _settings(
    problem: str, names: dict[Role, str | None], preset: str | None, values: Any, given: dict[str, Any]
) -> tuple[Venue, dict[Role, Recipe]]:
    """One configuration for both recipes: what they need together, and what is asked for."""
    from cps_agents.league.response import merged, recipe_of
    from cps_agents.learning.recipe import changed
    from cps_baselines.arena import Venue

    recipes = {role: recipe_of(problem, role, name) for role, name in names.items()}
    needed = [{key: each for key, each in recipe.overrides.items() if key not in values} for recipe in recipes.values()]
    presets = [{"preset": recipe.preset} for recipe in recipes.values()] if preset is None else [{"preset": preset}]
    venue = Venue(problem, merged(presets, "a recipe")["preset"], {**merged(needed, "a recipe"), **values})
    settled = {"preset": venue.preset, "overrides": dict(venue.overrides)}
    return venue, {role: changed(recipe, {**given, **settled}) for role, recipe in recipes.items()}


def _game(
    venue: Venue,
    references: dict[Role, list[str]],
    recipes: dict[Role, Recipe],
    episodes: int,
    budget: Budget,
    store: Store,
) -> Game:
    """With those of the policies asked for that can play."""
    from cps_agents.league.league import Plan, check_anybody, line_up
    from cps_agents.league.self_play import Game
    from cps_baselines.workers import Workers
    from cps_envs.core.types import ROLES

    with Workers(budget.workers) as pool:
        players, left_out = line_up(Plan(venue, references, episodes), store, pool)
    for missing in left_out:
        err().print(f"Left out: {missing.role} {missing.reference}: {missing.reason}", markup=False, soft_wrap=True)
    for role in ROLES:
        check_anybody(role, players, left_out)
    start = {role: [player.reference for player in players[role]] for role in ROLES}
    return Game(venue, start, recipes, episodes, budget.seeds)


def _play(game: Game, folder: Path, store: Store, iterations: int, budget: Budget) -> Outcome:
    """Iterate; after each iteration the results are judged and written."""
    from cps_agents.files import write_figure, write_json
    from cps_agents.league.bounds import judge
    from cps_agents.league.self_play import iterate
    from cps_agents.league.self_play_report import draw

    outcomes = []

    def report(pool: Pool, done: list[Iteration]) -> None:
        outcomes.append(judge(game, pool, done, store, budget.workers))
        write_json(folder / "self-play.json", _document(outcomes[-1]))
        write_figure(folder / "self-play.png", draw(outcomes[-1]))

    iterate(game, folder, store, iterations, budget, report)
    return outcomes[-1]


def _document(outcome: Outcome) -> dict[str, Any]:
    from cps_agents.league.self_play_report import document
    from cps_agents.machine import describe

    return document(outcome, describe())


def _show(outcome: Outcome) -> None:
    from cps_agents.league.self_play_report import table
    from cps_envs.core.types import ROLES

    console = out()
    console.print(table(outcome))
    for role in ROLES:
        console.print(f"The final {role} plays as {outcome.final[role].reference}", markup=False, soft_wrap=True)
    console.print(f"Training: {outcome.steps:,} steps, {outcome.cpu_s:.0f} CPU s.")
