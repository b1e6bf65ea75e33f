"""`cps-envs best-response`: how far can a fixed opponent be exploited?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.arena.statistics import Estimate
from cps_agents.commands.options import (
    MEETINGS,
    AsJson,
    AtCluster,
    BudgetS,
    Changes,
    Config,
    Fresh,
    Jobs,
    Knobs,
    Meetings,
    Oracles,
    Steps,
    conclude,
    described,
    kept,
    role_named,
    workers,
)
from cps_agents.console import assignments, note, out, print_json
from cps_agents.errors import CommandError
from cps_agents.files import alone_in, write_json
from cps_agents.league.exploitability import Judgement, gain_over, judge, league_value, line_up_known
from cps_agents.league.oracles import KINDS, SEARCHES, Oracle, choose_oracles, in_venue
from cps_agents.league.report import stacked
from cps_agents.league.response import Budget, Question, Responses, respond
from cps_agents.league.strategy import Strategy, mix
from cps_agents.league.venues import venue_against
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.recipes.finding import usual_recipe
from cps_agents.scoring.exploits import KNOWN, Exploit, entry_at, keep_exploit
from cps_agents.sheet import Sheet
from cps_agents.zoo.references import is_trained
from cps_envs import find_problem
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.policies.lookup import parsed
from cps_envs.core.types import Role, other

AGAINST = "Respond to this {}: its name or zoo:NAME. May be repeated: several are mixed."
COMPARED = "Compare with this policy, or `all`: computed and shipped ones. Default: all."
PRESET = "Preset of the environment; default: the one the opponent learned in, or else the recipe's."
ENTRY = "Respond to this leaderboard entry, leaderboard/VERSION/TRACK/NAME, in its game; keep what is found."
ENTRY_SEED = "Respond to this training seed of --entry; default: the one that plays."
LEAST_EPISODES = 16  # for a board
LEAGUE = "Compare with the value in this JSON of `cps-envs league`, same configuration."


def best_response(
    problem: Annotated[str, typer.Argument(help="Problem, such as hvac.")],
    role: Annotated[str, typer.Argument(help="Role that responds: attacker or defender.")],
    attacker: Annotated[list[str] | None, typer.Option(help=AGAINST.format("attacker"))] = None,
    defender: Annotated[list[str] | None, typer.Option(help=AGAINST.format("defender"))] = None,
    entry: Annotated[Path | None, typer.Option(metavar="FOLDER", help=ENTRY)] = None,
    entry_seed: Annotated[int | None, typer.Option(min=0, help=ENTRY_SEED)] = None,
    weights: Annotated[
        str | None, typer.Option(help="Weights of several opponents, such as 1,3; default: equal.")
    ] = None,
    oracle: Oracles = None,
    preset: Annotated[str | None, typer.Option(help=PRESET)] = None,
    config: Config = None,
    overrides: Changes = None,
    knobs: Knobs = None,
    steps: Steps = None,
    budget: BudgetS = None,
    seeds: Annotated[int, typer.Option(min=1, help="Use so many training seeds.")] = 1,
    known: Annotated[list[str] | None, typer.Option("--known", metavar="NAME", help=COMPARED)] = None,
    league: Annotated[Path | None, typer.Option(metavar="FILE.json", help=LEAGUE)] = None,
    episodes: Annotated[
        int, typer.Option(min=1, max=1_000_000, help="Judge on so many episodes, on seeds 0, 1, ...")
    ] = 50,
    folder: Annotated[Path, typer.Option("--out", help="Write runs and results to this folder.")] = Path(
        "best-response"
    ),
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    cluster: AtCluster = None,
    fresh: Fresh = False,
    resume: Annotated[bool, typer.Option("--resume", help="Continue unfinished runs.")] = False,
    as_json: AsJson = False,
) -> None:
    """Find a best response to a fixed opponent: at least how far can it be exploited?

    Our own PPO looks for one, and a search over the numbers of hand-made policies. Validation seeds choose among all
    that they find and all policies known before; the best of both play fresh episodes. The result is a lower bound: a
    better response may exist.
    """
    if entry is not None:
        if attacker or defender or preset or overrides or config:
            raise CommandError("--entry names opponent and game: leave out --attacker, --defender, --preset, --config")
        if episodes < LEAST_EPISODES:
            raise CommandError(
                f"--entry takes --episodes {LEAST_EPISODES} or more, for the interval on the leaderboard"
            )
        attacker, defender, preset = _entered(entry, entry_seed, problem, role_named(role))
    elif entry_seed is not None:
        raise CommandError("--entry-seed names a training seed of --entry: write both")
    mine, against = role_named(role), _against(role_named(role), attacker, defender)
    asked = described(find_problem(problem), preset, config, overrides)
    question, oracles = _question(problem, mine, mix(against, _weights(weights)), oracle, asked, episodes)
    oracles = in_venue(oracles, question.venue, assignments(knobs or [], "--knob", "learning_rate=0.001"))
    spent = Budget(seeds, workers(jobs, cluster), describe()["command"], 0, steps, budget, resume=resume)
    value = None if league is None else league_value(league, question.venue)
    store = kept(meetings, fresh=fresh)
    with alone_in(folder):
        present, left_out = line_up_known(question, known or ["all"], store, spent.workers)
        question = replace(question, known=tuple(each.reference for each in present.players(mine)))
        responses = respond(oracles, question, folder, spent, store, "response", note)
        with Progress("pairs", 1) as progress:
            judgement = judge(question, present, left_out, responses, store, spent.workers, progress.report)
        over_value = None if value is None else gain_over(value, judgement.response_pay, question.role)
        content = _document(question, oracles, responses, judgement, over_value) | describe()
        write_json(folder / "best-response.json", content)
        if entry is not None:
            _keep(entry, entry_seed, judgement, present.players(mine), responses)
    if as_json:
        print_json(content)
    else:
        _show(question, responses, judgement, over_value)
    conclude([folder / "best-response.json"], store)
    note(f"The response plays as {responses.chosen.reference}")


def _entered(entry: Path, seed: int | None, problem: str, role: Role) -> tuple[list[str] | None, list[str] | None, str]:
    """The attacker or the defender that an entry is, or its network of a training seed, and the preset of its track."""
    score = entry_at(entry)
    track = score.frozen.track
    if (track.problem, track.role) != (problem, other(role)):
        raise CommandError(f"{entry} is of {track.name}: to it responds `{track.problem} {other(track.role)}`")
    if seed is not None and str(seed) not in score.pays:
        raise CommandError(
            f"{entry} has no training seed {seed}: it has {', '.join(filter(None, score.pays)) or 'none'}"
        )
    policy = score.policy if seed is None else parsed(score.policy).with_option("seed", seed)
    attacker, defender = ([policy], None) if track.role == "attacker" else (None, [policy])
    return attacker, defender, track.venue.preset


def _keep(
    entry: Path, seed: int | None, judgement: Judgement, known: Sequence[Contestant], responses: Responses
) -> None:
    """Keep the best of all that played for the entry on the leaderboard."""
    names = {each.name: (KNOWN, each.reference) for each in known}
    names |= {f"{each.oracle}, seed {each.seed}": (each.oracle, each.reference) for each in responses.found}
    by, reference = names[judgement.best]
    oracle, best_known = names[judgement.response][0], names[judgement.known][1]
    score = entry_at(entry)
    kept = Exploit(
        policy=score.policy if seed is None else parsed(score.policy).with_option("seed", seed),
        sources=score.sources,
        by=by,
        response="" if by != KNOWN and is_trained(reference) else reference,  # a network that lies in `--out`
        pay=judgement.pay,
        over=oracle if by == KNOWN else best_known,
        gain=judgement.gain,
        cpu_s=responses.cpu_s,
    )
    note(f"On the leaderboard: {keep_exploit(entry, kept, seed)}")


def _question(
    problem: str,
    mine: Role,
    strategy: Strategy,
    names: list[str] | None,
    asked: tuple[str | None, dict[str, Any]],
    episodes: int,
) -> tuple[Question, list[Oracle]]:
    """What is asked, in the preset and with the changed fields of `asked`, and who is to respond."""
    oracles = choose_oracles(problem, mine, names or KINDS)
    recipe = next((each.recipes[0] for each in oracles if each.name != SEARCHES), usual_recipe(problem, mine))
    venue = venue_against(strategy, recipe, *asked)
    return Question(mine, strategy, venue, episodes), oracles


def _against(role: Role, attacker: list[str] | None, defender: list[str] | None) -> list[str]:
    """The policies of the other role to respond to."""
    rival = other(role)
    own, against = (defender, attacker) if rival == "attacker" else (attacker, defender)
    if own or not against:
        raise CommandError(f"the {role} responds: name whom to, with --{rival} NAME, and no --{role}")
    return against


def _weights(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise CommandError(f"--weights {text!r}: write numbers with commas between them, such as 1,3") from error


def _document(
    question: Question,
    oracles: Sequence[Oracle],
    responses: Responses,
    judgement: Judgement,
    over_value: Estimate | None,
) -> dict[str, Any]:
    return {
        "problem": question.venue.problem,
        "role": question.role,
        "against": question.strategy.reference,
        "opponent": dict(zip(question.strategy.policies, question.strategy.probabilities, strict=True)),
        "preset": question.venue.preset,
        "config": asdict(question.venue.config),
        "oracles": [asdict(oracle) for oracle in oracles],
        "oracles_left_out": dict(responses.left_out),
        "budget": {"steps": responses.steps, "cpu_s": responses.cpu_s},
        "responses": [asdict(each) for each in responses.found],
        "chosen": asdict(responses.chosen),
        "reference": responses.chosen.reference,
        "judgement": {**asdict(judgement), "best": judgement.best, "pay": asdict(judgement.pay)},
        "gain_over_league": None if over_value is None else asdict(over_value),
    }


def _show(question: Question, responses: Responses, judgement: Judgement, over_value: Estimate | None) -> None:
    console = out()
    fresh = {judgement.response: judgement.response_pay, judgement.known: judgement.known_pay}
    spent = {f"{each.oracle}, seed {each.seed}": f"{each.cpu_s:.0f}" for each in responses.found}
    rows = [
        (name, stacked(found), stacked(fresh[name]) if name in fresh else "", spent.get(name, ""))
        for name, found in judgement.validation.items()
    ]
    unit = find_problem(question.venue.problem).unit_of(question.venue.config) or "return"
    title = f"{question.venue.problem}: the attacker's return, {unit}; opponent: {question.strategy.reference}"
    console.print(Sheet(title, (question.role, "return, all", "return, fresh episodes", "found in, CPU s"), rows))
    console.print(_verdict(f"the best policy known before, {judgement.known},", judgement.gain), markup=False)
    if over_value is not None:
        console.print(_verdict("the value of the league's game", over_value), markup=False)
    what = "worst attack" if question.role == "attacker" else "best defence"
    console.print(f"The {what} found is {judgement.best}: the attacker's return is {judgement.pay:.4g}.", markup=False)
    console.print(f"Spent: {responses.steps:,} steps, {responses.cpu_s:.0f} CPU s.")


def _verdict(what: str, gain: Estimate) -> str:
    shown = gain.mean > 0 and not (gain.low is not None and gain.low <= 0)
    so = "the opponent can be exploited by at least that" if shown else "these oracles show no more than was known"
    return f"Over {what} the response gains {gain:.4g}: {so}."
