"""Who met whom and what came out, as plain data for a page: players, metrics with intervals, episodes to watch.

Pairs of a board are played where they were not: what cannot play is told and does not stop the others.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cps_agents.arena.admission import LONGEST_NAME
from cps_agents.arena.meeting import Meeting, Result, attempt
from cps_agents.arena.play import Report, silent
from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.arena.store import Store
from cps_agents.arena.table import RETURN, Pair, Table
from cps_agents.catalogue import policies
from cps_agents.errors import CommandError, explain
from cps_agents.league.league import League, check_anybody, line_up, standings
from cps_agents.league.meetings import LeftOut, payoffs_of
from cps_agents.report.replay import Take
from cps_agents.workers import Where, Workers
from cps_agents.zoo.references import Origin, is_trained
from cps_envs import find_problem
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import parsed
from cps_envs.core.types import ROLES, FloatArray, Role

DIGITS = 6  # significant, of numbers on the page
VALUED = 20  # episodes of a pair from which the value of the game is stated
BOUNDED = 5  # and those from which a mean has an interval: of fewer it would reach beyond what a return can be
FEW = f"The value of the game and its mixtures are shown from {VALUED} episodes of each pair on: see --episodes."


@dataclass(frozen=True)
class Board:
    """Attackers in rows, defenders in columns; a result is missing where a pair has not played."""

    table: Table
    left_out: LeftOut
    results: Mapping[Pair, Result]  # of those that have played
    refused: Mapping[Pair, str] = field(default_factory=dict)  # why a pair cannot play
    league: League | None = None  # where every pair has played

    @property
    def problem(self) -> Problem:
        """The problem."""
        return find_problem(self.table.venue.problem)

    @property
    def missing(self) -> int:
        """So many pairs have not played, though they can."""
        return len(self.table.pairs) - len(self.results) - len(self.refused)

    def takes(self, count: int) -> dict[Pair, list[Take]]:
        """The episodes of each pair that are worth watching: the median one by return, then the extremes."""
        return {
            pair: [
                Take(self.table.meeting(pair), seed, file_key(self.problem.name, *pair, seed))
                for seed in telling(result["metrics"][RETURN], count)
            ]
            for pair, result in self.results.items()
        }


def board_of(league: League) -> Board:
    """The board of a league that has been played."""
    return Board(league.table, league.left_out, league.payoffs.results, league=league)


def kept_board(table: Table, store: Store) -> Board:
    """What is there of a league that was interrupted; nothing is played.

    Raises:
        CommandError: no pair of it has played.
    """
    kept = {pair: result for pair in table.pairs if (result := _kept(table, store, pair)) is not None}
    if not kept:
        venue = table.venue
        raise CommandError(
            f"no finished meetings of {venue.problem} (preset {venue.preset}, {table.episodes} episodes) are "
            f"kept in {store.folder}: play them, without --kept, or name their --episodes, --preset and --meetings"
        )
    rows, columns = ({axis: k for k, axis in enumerate(sorted({pair[side] for pair in kept}))} for side in (0, 1))
    attackers, defenders = [table.attackers[i] for i in rows], [table.defenders[j] for j in columns]
    results = {(rows[i], columns[j]): result for (i, j), result in kept.items()}
    return Board(replace(table, attackers=attackers, defenders=defenders), {}, results)


def _kept(table: Table, store: Store, pair: Pair) -> Result | None:
    try:
        return store.get(table.meeting(pair))
    except ValueError:  # their own forms make no configuration together
        return None


def telling(returns: Sequence[float], count: int) -> list[int]:
    """Which episodes to show: the median one, the most and the least for the attacker, then the others."""
    order = np.argsort(returns, kind="stable").tolist()
    first = [order[len(order) // 2], order[-1], order[0]]
    return list(dict.fromkeys([*first, *sorted(order)]))[:count]


def file_key(problem: str, row: int, column: int, seed: int) -> str:
    """The name of an episode's file, without suffix."""
    return f"{re.sub('[^a-z0-9]+', '-', problem.lower())}-{row}-{column}-{seed}"


def document(board: Board, takes: Mapping[Pair, Sequence[Take]]) -> dict[str, Any]:
    """Everything but the episodes, as plain data."""
    table, problem = board.table, board.problem
    few = FEW if board.league is not None and table.episodes < VALUED else ""
    shares = {} if few else _shares(board.league)
    return {
        "name": problem.name,
        "title": problem.name.capitalize() if len(problem.name) > 4 else problem.name.upper(),
        "summary": problem.summary,
        "unit": problem.unit_of(table.venue.config),
        "version": problem.version,
        "preset": table.venue.preset,
        "overrides": {name: str(value) for name, value in table.venue.overrides.items()},
        "episodes": table.episodes,
        "missing": board.missing,
        "value": None if few else _value(board.league),
        "few": few,
        "attackers": _players(board, "attacker", shares),
        "defenders": _players(board, "defender", shares),
        "left_out": [
            {"role": role, "name": reference, "reason": reason} for (role, reference), reason in board.left_out.items()
        ],
        "cells": [
            [_cell(board, (i, j), takes.get((i, j), ())) for j in range(len(table.defenders))]
            for i in range(len(table.attackers))
        ],
    }


def _shares(league: League | None) -> dict[str, float]:
    if league is None:
        return {}
    return {f"{role} {each.player.name}": each.probability for role in ROLES for each in standings(league, role)}


def _value(league: League | None) -> dict[str, float | None] | None:
    return None if league is None else _interval(league.value)


def _players(board: Board, role: Role, shares: Mapping[str, float]) -> list[dict[str, Any]]:
    about = {entry.name: entry.summary for entry in policies(board.problem, role)}
    return [
        {
            "name": each.name,
            "reference": each.reference,
            "trained": is_trained(each.reference),
            "about": about.get(parsed(each.reference).title, "") or _training(board.table.origin(each.reference)),
            "share": round(shares[f"{role} {each.name}"], 4) if shares else None,
        }
        for each in board.table.players(role)
    ]


def _training(origin: Origin) -> str:
    """How a trained policy came about, in a sentence; empty for others, and for one that is not there."""
    card = origin.card
    if card is None:
        return ""
    opponent = f"`{card.opponent}`" if len(card.opponent) <= LONGEST_NAME else "a mixture of opponents"
    return f"Trained by {card.algorithm} against {opponent}, from preset `{card.preset}`."


def _cell(board: Board, pair: Pair, takes: Sequence[Take]) -> dict[str, Any] | str:
    """What came out, or why there is nothing."""
    result = board.results.get(pair)
    if result is None:
        return board.refused.get(pair, "not played")
    values = {name: np.asarray(each, np.float64) for name, each in result["metrics"].items()}
    return {
        "metrics": {
            name: {**_interval(_estimate(each)), "values": [_short(value) for value in each.tolist()]}
            for name, each in values.items()
            if np.isfinite(each).all()
        },
        "takes": [{"seed": take.seed, "key": take.key} for take in takes],
    }


def _estimate(values: FloatArray) -> Estimate:
    found = estimate([values[None]])
    return found if len(values) >= BOUNDED else replace(found, low=None, high=None)


def _interval(found: Any) -> dict[str, float | None]:
    return {name: _short(getattr(found, name)) for name in ("mean", "low", "high")}


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{DIGITS}g}")


def play_board(
    table: Table,
    references: Mapping[Role, Sequence[str]],
    store: Store,
    workers: Where,
    told: Report = silent,
    most: int | None = None,
) -> Board:
    """Everybody against everybody, or `most` of each role that stand for the others.

    A pair that cannot play, as with forms that exclude each other, has no result; those who stand for the others can
    all meet.

    Raises:
        CommandError: a name that nothing has, or nobody left of a role.
    """
    with Workers(workers) as pool:
        present, left_out = line_up(table, references, store, pool, together=most is not None)
        check_anybody(present, left_out)
        attackers, defenders = some(present.attackers, most), some(present.defenders, most)
        shown = replace(present, attackers=attackers, defenders=defenders)
        results, refused = _play(shown, store, pool, told)
    whole = League(shown, left_out, payoffs_of(shown, results)) if len(results) == len(shown.pairs) else None
    return Board(shown, left_out, results, refused, whole)


def some(players: Sequence[Contestant], most: int | None) -> Sequence[Contestant]:
    """At most so many, evenly from the first to the last."""
    if most is None or len(players) <= most:
        return players
    return [players[place] for place in np.linspace(0, len(players) - 1, most).round().astype(int)]


def _play(table: Table, store: Store, pool: Workers, told: Report) -> tuple[dict[Pair, Result], dict[Pair, str]]:
    results, refused = {}, {}
    left: list[tuple[Pair, Meeting]] = []
    for pair in table.pairs:
        try:
            meeting = table.meeting(pair)
            found = store.get(meeting)
        except ValueError as error:  # their own forms make no configuration together
            refused[pair] = str(error)
            continue
        if found is None:
            left.append((pair, meeting))
        else:
            results[pair] = found
    for done, ((pair, meeting), (result, reason)) in enumerate(pool.run(_try, left), start=1):
        if result is None:
            refused[pair] = reason
        else:
            store.put(meeting, result)
            results[pair] = result
        told(done, len(left), meeting.label)
    return results, refused


def _try(item: tuple[Pair, Meeting]) -> tuple[Result | None, str]:
    try:
        return attempt(item[1]), ""
    except CommandError as error:
        return None, explain(error.__cause__ if isinstance(error.__cause__, Exception) else error) or str(error)
