"""A contest as plain data, from which tables, pages and files are written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeAlias

import numpy as np

from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.contest.jobs import Effort, Played
from cps_agents.contest.rules import BEST_CONSTANT, NEUTRAL, TOLD, Finding, judge, shortfall
from cps_agents.league.equilibrium import game_value, solve
from cps_baselines.arena import Contestant
from cps_baselines.contest import Column, Contest
from cps_envs import find_problem
from cps_envs.core.types import SIGN, FloatArray, Role, other

Document: TypeAlias = dict[str, Any]
LEAST_SHARE = 0.005  # of a mixed strategy that is worth telling


def document(played: Played, effort: Effort, machine: Mapping[str, Any], wall_s: float) -> Document:
    """Everything about a variant of a contest."""
    contest, variant, problem = played.contest, played.variant, find_problem(played.contest.problem)
    judged = bool(played.responses)
    findings = judge(played) if judged else []
    return {
        **machine,
        "wall_s": round(wall_s, 1),
        "cpu_s": round(played.cpu_s, 1),
        "problem": problem.name,
        "version": problem.version,
        "variant": variant.name,
        "title": variant.title,
        "preset": variant.preset,
        "overrides": dict(variant.overrides),
        "unit": find_problem(contest.problem).unit,
        "effort": asdict(effort),
        "episodes": effort.episodes or contest.episodes,
        "columns": [asdict(column) for column in contest.columns],
        "attackers": list(_rows(played, "attacker")),
        "defenders": list(_rows(played, "defender")),
        "constraint": _constraint(played),
        "rules": [_rule(finding) for finding in findings],
        "holds": all(finding.holds for finding in findings) if judged else None,
        "game": _game(played) if judged else None,
        "searches": list(played.searches),
        **remarks(contest),
    }


def remarks(contest: Contest) -> dict[str, Any]:
    """What a contest says in words, whatever comes out."""
    sides = {"attacker": contest.attackers, "defender": contest.defenders}
    return {
        "left_out": {role: dict(side.left_out) for role, side in sides.items()},
        "notes": list(contest.notes),
    }


def _rule(finding: Finding) -> dict[str, Any]:
    return {**asdict(finding), "lead": plain(finding.lead)}


def plain(found: Estimate) -> dict[str, float | None]:
    """Mean and interval."""
    return {"mean": found.mean, "low": found.low, "high": found.high}


def _game(played: Played) -> dict[str, Any]:
    """The zero-sum game of all policies and all attacks that were searched, on the validation episodes."""
    attacks = [*played.contest.attackers.policies, *played.found]
    defences = list(played.contest.defenders.policies)
    payoffs = np.array(
        [[played.validation[attack.name, defence.name]["return"] for defence in defences] for attack in attacks]
    )
    found = solve(payoffs.mean(axis=2))
    return {
        "value": plain(game_value(payoffs)),
        "value_of_means": found.value,
        "attacker": _played(attacks, found.attacker),
        "defender": _played(defences, found.defender),
    }


def _played(contestants: Sequence[Contestant], probabilities: FloatArray) -> dict[str, float]:
    shares = {contestant.name: float(share) for contestant, share in zip(contestants, probabilities, strict=True)}
    return {name: share for name, share in shares.items() if share > LEAST_SHARE}


def _rows(played: Played, role: Role) -> Iterator[dict[str, Any]]:
    side, constant = played.side(role), played.constant(role)
    groups: list[tuple[str, list[Contestant]]] = [
        ("policy", list(side.policies)),
        ("informed", list(side.informed)),
        ("constant", [constant] if constant else []),
        ("searched", played.searched if role == "defender" else []),
    ]
    for kind, contestants in groups:
        for contestant in contestants:
            yield _row(played, role, contestant, kind)
    if role == "attacker" and played.responses:
        yield {
            "name": TOLD,
            "reference": "",
            "kind": "informed",
            "score": plain(estimate([played.told()[None]])),
        }


def _row(played: Played, role: Role, contestant: Contestant, kind: str) -> dict[str, Any]:
    side, rivals = played.side(role), played.side(other(role)).policies
    values = played.values(role, contestant)
    means = {rival.name: float(row.mean()) for rival, row in zip(rivals, values, strict=True)}
    best = min(means, key=lambda name: SIGN[role] * means[name])  # for the other role
    row: dict[str, Any] = {
        "name": BEST_CONSTANT if kind == "constant" else contestant.name,
        "reference": contestant.reference,
        "kind": kind,
        "score": plain(estimate([values.mean(axis=0)[None]])),  # what the attacker is paid
        "against": means,
        "without": means.get(NEUTRAL),  # an attack, or a defence
        "worst": {"by": best, "mean": means[best]},
    }
    if role == "defender":
        row["columns"] = [_column(played, contestant, column) for column in played.contest.columns]
    if kind in ("policy", "informed"):
        row["paid"] = dict(_meetings(played, role, contestant))  # against informed references too
    if kind in ("policy", "informed") and played.responses:
        rival, lost = shortfall(played, role, contestant)
        row["shortfall"] = {"against": rival, **plain(estimate([lost[None]]))}
    if role == "defender" and side.informed:
        ideal = played.values(role, side.informed[0]).mean(axis=0)
        row["excess"] = plain(estimate([(values.mean(axis=0) - ideal)[None]]))
    response = played.responses.get(contestant.name) if role == "defender" else None
    if response is not None:
        paid = played.meetings[response.name, contestant.name]["return"]
        row["response"] = {"by": response.name, "reference": response.reference, **plain(estimate([paid[None]]))}
    return row


def _constraint(played: Played) -> dict[str, Any] | None:
    """Every defender's harm and cost over all attackers, and both beyond those of the reference, paired."""
    rule = played.contest.constraint
    if rule is None:
        return None
    contestants = [*played.rated("defender"), *played.searched]
    sides = {"harm": rule.harm.metric, "cost": rule.cost.metric}
    values = {
        each.name: {side: played.values("defender", each, metric).mean(axis=0) for side, metric in sides.items()}
        for each in contestants
    }
    usual = values[rule.reference]
    rows = [
        {
            "name": name,
            **{side: plain(estimate([mine[side][None]])) for side in sides},
            **{f"{side}_beyond": plain(estimate([(mine[side] - usual[side])[None]])) for side in sides},
        }
        for name, mine in values.items()
    ]
    return {**asdict(rule), "rows": rows}


def _meetings(played: Played, role: Role, contestant: Contestant) -> Iterator[tuple[str, float]]:
    for rival in played.rated(other(role)):
        pair = (contestant.name, rival.name) if role == "attacker" else (rival.name, contestant.name)
        yield rival.name, float(played.meetings[pair]["return"].mean())


def _column(played: Played, defender: Contestant, column: Column) -> float:
    """Over the episodes against all attackers and the response, or against one attacker."""
    attackers = played.contest.attackers.policies
    rows = dict(zip((each.name for each in attackers), played.values("defender", defender, column.metric), strict=True))
    response = played.responses.get(defender.name)
    if response is not None:
        rows.setdefault(response.name, played.meetings[response.name, defender.name][column.metric])
    every: FloatArray = np.array([rows[column.against]] if column.against else list(rows.values()))
    if column.over == "share":
        return float((every > 0).mean())
    if column.over == "smallest":
        return float(every.min())
    return float(np.median(every) if column.over == "median" else every.mean())
