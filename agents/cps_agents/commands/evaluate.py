"""`cps-envs evaluate`: any policies on the evaluation seeds, with intervals and paired differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from cps_agents.arena.admission import ALL, admit, contestants, short_name, usual
from cps_agents.arena.statistics import Estimate
from cps_agents.arena.store import Store
from cps_agents.arena.table import RETURN, Table
from cps_agents.arena.venue import Venue
from cps_agents.commands.options import (
    MEETINGS,
    AsJson,
    AtCluster,
    Attackers,
    Changes,
    Config,
    Defenders,
    Fresh,
    Jobs,
    Meetings,
    OfPart,
    Preset,
    conclude,
    described,
    kept,
    role_named,
    workers,
)
from cps_agents.console import note, out, print_json
from cps_agents.errors import CommandError, built_by_user
from cps_agents.evaluation import Standing, compare, is_better
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.sheet import Cell, Sheet, styled
from cps_agents.workers import Where
from cps_envs import find_problem
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.types import FloatArray, Role, other

BASELINE = "Compare with this policy, or with `all` that can play; may be repeated."
METRIC = "Measure this metric; `return` is the attacker's."
MARK = "*"  # of a baseline that the intervals say less about
HIDDEN = "!"  # of a policy whose worst training seed lies outside its interval
MOST = 1_000_000  # evaluation seeds


def evaluate(
    problem: Annotated[str, typer.Argument(help="Problem, such as hvac.")],
    role: Annotated[str, typer.Argument(help="Role to evaluate: attacker or defender.")],
    attacker: Attackers = None,
    defender: Defenders = None,
    baseline: Annotated[list[str] | None, typer.Option(help=BASELINE)] = None,
    preset: Preset = None,
    config: Config = None,
    overrides: Changes = None,
    episodes: Annotated[int, typer.Option(min=1, max=MOST, help="Play so many episodes with each training seed.")] = 50,
    first_seed: Annotated[
        int, typer.Option(min=0, max=MOST - 1, help="Play the episodes of this seed and the next.")
    ] = 0,
    metric: Annotated[str, typer.Option(help=METRIC)] = "return",
    per: Annotated[str, typer.Option(help="Divide by another metric of the episode, such as oracle_value_mps.")] = "",
    meetings: Meetings = MEETINGS,
    jobs: Jobs = None,
    cluster: AtCluster = None,
    part: OfPart = None,
    fresh: Fresh = False,
    as_json: AsJson = False,
) -> None:
    """Evaluate policies on seeds that training never used.

    ROLE says who is judged: its policies are compared, against each of the other role's. Prints mean, interquartile
    mean and 95 % bootstrap intervals over training seeds and episodes. Differences to the baselines are paired, episode
    by episode, and count the training seeds of both. Trained policies see and act in the form they were trained in.
    """
    known, found = role_named(role), find_problem(problem)
    chosen, values = described(found, preset, config, overrides)
    preset = chosen or found.usual_preset
    named: dict[Role, list[str]] = {"attacker": attacker or [], "defender": defender or []}
    policy = named[known]
    if not policy:
        raise CommandError(f"name the {known}s to judge: --{known} NAME")
    opponents = named[other(known)] or [found.opponents[preset][other(known)]]
    venue = Venue(problem, preset, values)
    if first_seed + episodes > MOST:
        raise CommandError(f"seeds up to {first_seed + episodes - 1} are asked for: evaluations end at {MOST - 1:,}")
    sides = {
        known: _contestants(venue, known, policy),
        other(known): _contestants(venue, other(known), opponents),
    }
    bars = _contestants(venue, known, baseline or [])
    table = Table(
        venue, sides["attacker"], sides["defender"], episodes, metric, per, first_seed, judged=known, bars=bars
    )
    standings = _compare(table, kept(meetings, fresh=fresh, part=part), workers(jobs, cluster))
    if as_json:
        heading = {"problem": problem, "role": role, "preset": preset, "overrides": dict(values)}
        played = {"episodes": episodes, "first_seed": first_seed}
        measured = {"metric": metric, "per": table.per}
        print_json({**describe(), **heading, **played, **measured, "standings": [each.to_json() for each in standings]})
        return
    for rival in table.players(other(known)):
        _print(table, known, [each for each in standings if each.opponent == rival.name])


def _contestants(venue: Venue, role: Role, names: Sequence[str]) -> list[Contestant]:
    """Those named, with `all` in full."""
    every = _everybody(venue, role) if ALL in names else []
    references = [each for name in names for each in (every if name == ALL else [name])]
    return [Contestant(reference) for reference in dict.fromkeys(references)]


def _everybody(venue: Venue, role: Role) -> list[str]:
    """The usual policies that can play; which of them cannot is told."""
    found = [(each.reference, admit(venue, role, each)) for each in contestants(venue, usual(venue, role))]
    for reference, admission in found:
        if admission.refusal:
            note(f"Left out: {role} {reference}: {admission.refusal}")
    return [reference for reference, admission in found if admission.plays]


def _compare(table: Table, store: Store, where: Where) -> list[Standing]:
    with built_by_user(), Progress("policies against opponents", 1) as progress:
        standings = compare(table, store, where, progress.report)
    conclude([], store)
    return standings


def _print(table: Table, role: Role, standings: list[Standing]) -> None:
    opponent, bars, is_pay = standings[0].opponent, [each.name for each in table.bars], table.metric == RETURN
    rows = [
        [
            styled("(baseline)", "dim", f"{each.policy} ") if each.is_baseline else each.policy,
            f"{each.mean.seeds} x {each.mean.episodes}",
            f"{each.mean.mean:.4g}",
            _interval(each.mean),
            *(_worst(each) if is_pay else ranges(each.values)),
            f"{each.iqm.mean:.4g}",
            *(_difference(each, name, role if is_pay else None) for name in bars),
        ]
        for each in standings
    ]
    cautions = {name: text for each in standings for name, text in each.cautions.items()}
    columns = (
        "policy",
        "seeds x episodes",
        "mean",
        "95 % interval",
        *(("worst seed",) if is_pay else ("least and most of a seed", "of an episode")),
        "IQM",
        *(f"minus {name}{MARK if name in cautions else ''}" for name in bars),
    )
    out().print(Sheet(f"{role} against {short_name(opponent)}: {table.measured}", columns, rows))
    for name, text in cautions.items():
        out().print(f"{MARK} {name}: {text}.", markup=False, soft_wrap=True)
    if any(each.hides_its_worst for each in standings):
        out().print(f"{HIDDEN} the worst training seed lies outside the interval of the mean.")
    if bars:
        colours = "; green or red where it excludes zero, for or against the policy" if is_pay else ""
        note(f"Differences: mean and interval{colours}.")


def _worst(standing: Standing) -> tuple[str]:
    if standing.worst_seed is None:
        return ("",)
    return (f"{standing.worst_seed:.4g}{f' {HIDDEN}' if standing.hides_its_worst else ''}",)


def ranges(values: FloatArray) -> tuple[str, str]:
    """Of a metric, of which nobody says whether more is worse: the range of training seeds, and of all episodes."""
    means = values.mean(axis=1)
    seeds = f"{means.min():.4g} to {means.max():.4g}" if len(means) > 1 else ""
    return seeds, f"{values.min():.4g} to {values.max():.4g}"


def _interval(found: Estimate) -> str:
    return "none" if found.low is None or found.high is None else f"{found.low:.4g} to {found.high:.4g}"


def _difference(standing: Standing, baseline: str, role: Role | None) -> Cell:
    """In green or red for a role that the number is good or bad for; for none, without a colour."""
    if baseline not in standing.differences:
        return ""
    found = standing.differences[baseline]
    text = f"{found.mean:+.4g}\n{_interval(found)}"
    better = None if role is None else is_better(found, role)
    return text if better is None else styled(text, "green" if better else "red")
