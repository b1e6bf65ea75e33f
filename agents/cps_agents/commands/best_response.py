"""`cps-envs best-response`: how far can a fixed opponent be exploited?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cps_agents.commands.options import MEETINGS, AsJson, Jobs, Meetings
from cps_agents.console import assignments, err, make_table, out, print_json
from cps_agents.errors import CommandError

if TYPE_CHECKING:
    from cps_agents.arena.statistics import Estimate
    from cps_agents.arena.store import Store
    from cps_agents.league.exploitability import Contest, Judgement
    from cps_agents.league.response import Budget, Trained
    from cps_agents.learning.recipe import Recipe

AGAINST = "Fixed opponent: a policy's name or zoo:NAME. May be repeated: several are mixed."
KNOWN = "Compare with this policy, or `all`: computed and shipped ones. Default: all."
LEAGUE = "Compare with the value in this JSON of `cps-envs league`, same configuration."


def best_response(
    problem: Annotated[str, typer.Argument(help="Problem, such as hvac.")],
    role: Annotated[str, typer.Argument(help="Role to train: attacker or defender.")],
    against: Annotated[list[str], typer.Option(help=AGAINST)],
    weights: Annotated[
        str | None, typer.Option(help="Weights of several opponents, such as 1,3; default: equal.")
    ] = None,
    recipe: Annotated[
        str | None, typer.Option(help="Recipe (see `cps-envs train --list`); default: the role's.")
    ] = None,
    preset: Annotated[str | None, typer.Option(help="Preset of the environment; default: the recipe's.")] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated."),
    ] = None,
    knobs: Annotated[
        list[str] | None,
        typer.Option("--knob", metavar="NAME=VALUE", help="Change a knob; may be repeated."),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(min=1, help="Train for so many decisions per seed, searches included.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Use so many training seeds.")] = 5,
    known: Annotated[list[str] | None, typer.Option("--known", metavar="NAME", help=KNOWN)] = None,
    league: Annotated[Path | None, typer.Option(metavar="FILE.json", help=LEAGUE)] = None,
    episodes: Annotated[
        int, typer.Option(min=1, max=1_000_000, help="Judge on so many episodes, on seeds 0, 1, ...")
    ] = 50,
    folder: Annotated[Path, typer.Option("--out", help="Write runs and results to this folder.")] = Path(
        "best-response"
    ),
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue unfinished runs.")] = False,
    device: Annotated[str, typer.Option(help="Device: cpu, cuda or auto.")] = "cpu",
    as_json: AsJson = False,
) -> None:
    """Train a best response to a fixed opponent: at least how far can it be exploited?

    Validation seeds choose among the training seeds, and evaluation seeds judge the choice. The result is a lower
    bound: a better response may exist that this training did not find.
    """
    from cps_agents.arena.store import Store
    from cps_agents.files import write_json
    from cps_agents.league.exploitability import Contest, gain_over, league_value
    from cps_agents.league.response import Budget, differing_presets, limited, venue_of
    from cps_agents.league.strategy import mix
    from cps_agents.locking import alone_in
    from cps_agents.machine import available_cores, describe
    from cps_envs.core.errors import require
    from cps_envs.core.types import ROLES

    chosen = next((each for each in ROLES if each == role), None)
    if chosen is None:
        raise CommandError(f"{role!r} is not a role: write attacker or defender")
    for package in ("stable_baselines3", "sb3_contrib"):
        require(package, extra="train", purpose="training a best response")
    strategy = mix(against, _weights(weights))
    values = {"preset": preset, "overrides": dict(assignments(overrides or []))}
    given = {name: value for name, value in values.items() if value is not None}
    given |= assignments(knobs or [], "--knob", "learning_rate=0.001")
    trained_by = limited(_recipe(problem, chosen, recipe, strategy, given), steps)
    for name in differing_presets(trained_by, strategy):
        err().print(
            f"Note: this trains in preset {trained_by.preset}, but the opponent learned in another: {name}. "
            "--preset chooses.",
            markup=False,
            soft_wrap=True,
        )
    contest = Contest(venue_of(trained_by), chosen, strategy, known or ["all"], episodes)
    budget = Budget(seeds, jobs or available_cores(), describe()["command"], resume=resume, device=device)
    value = None if league is None else league_value(league, contest.venue)
    with alone_in(folder):
        trained, judgement = _run(contest, trained_by, budget, folder, Store(meetings))
        over_value = None if value is None else gain_over(value, judgement.response, chosen)
        content = _document(contest, trained_by, trained, judgement, over_value) | describe()
        write_json(folder / "best-response.json", content)
    if as_json:
        print_json(content)
    else:
        _show(contest, trained, judgement, over_value)
    err().print(f"Written: {folder / 'best-response.json'}. The response plays as {trained.reference}", soft_wrap=True)


def _weights(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise CommandError(f"--weights {text!r}: write numbers with commas between them, such as 1,3") from error


def _recipe(problem: str, role: Any, name: str | None, strategy: Any, given: dict[str, Any]) -> Recipe:
    """The recipe with what was asked for, and then with the opponent in the configuration that this gives."""
    from cps_agents.league.response import against, recipe_of
    from cps_agents.learning.recipe import changed

    recipe = changed(recipe_of(problem, role, name), given)
    return against(recipe, strategy, name=f"{recipe.name}-response")


def _run(contest: Contest, recipe: Recipe, budget: Budget, folder: Path, store: Store) -> tuple[Trained, Judgement]:
    from cps_agents.league.exploitability import judge
    from cps_agents.league.response import respond
    from cps_agents.progress import Progress

    trained = respond(recipe, folder, budget, recipe.name)
    with Progress("evaluation pairs", 1) as progress:
        judgement = judge(contest, trained, store, budget.workers, progress.report)
    return trained, judgement


def _document(
    contest: Contest, recipe: Recipe, trained: Trained, judgement: Judgement, over_value: Estimate | None
) -> dict[str, Any]:
    from dataclasses import asdict

    return {
        "problem": contest.venue.problem,
        "role": contest.role,
        "against": contest.opponent.reference,
        "opponent": dict(zip(contest.opponent.policies, contest.opponent.probabilities, strict=True)),
        "config": asdict(contest.venue.config),
        "recipe": asdict(recipe),
        "budget": {"seeds": len(trained.references), "steps": trained.steps, "cpu_s": trained.cpu_s},
        "validation": trained.validation,
        "chosen_seed": trained.seed,
        "reference": trained.reference,
        **asdict(judgement),
        "gain_over_league": None if over_value is None else asdict(over_value),
    }


def _show(contest: Contest, trained: Trained, judgement: Judgement, over_value: Estimate | None) -> None:
    from cps_agents.league.report import stacked
    from cps_envs import find_problem

    console = out()
    rows = [(f"response, seed {trained.seed}", stacked(judgement.response))]
    rows += [(f"response, all {len(trained.references)} seeds", stacked(judgement.all_seeds))]
    rows += [(name, stacked(found)) for name, found in judgement.known.items()]
    unit = find_problem(contest.venue.problem).unit or "return"
    title = f"{contest.venue.problem}: what the attacker is paid ({unit}); opponent: {contest.opponent.reference}"
    console.print(make_table(title, (contest.role, "return"), rows))
    console.print(_verdict(f"the best policy known before, {judgement.best_known},", judgement.gain), markup=False)
    if over_value is not None:
        console.print(_verdict("the value of the league's game", over_value), markup=False)
    console.print(f"Budget: {len(trained.references)} seeds, {trained.steps:,} steps, {trained.cpu_s:.0f} CPU s.")


def _verdict(what: str, gain: Estimate) -> str:
    ends = "" if gain.low is None else f" [{gain.low:.4g}, {gain.high:.4g}]"
    if gain.mean <= 0 or (gain.low is not None and gain.low <= 0):
        return f"Over {what} the response gains {gain.mean:.4g}{ends}: this training shows no more than was known."
    return f"Over {what} the response gains {gain.mean:.4g}{ends}: the opponent can be exploited by at least that."
