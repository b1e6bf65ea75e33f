"""Playing the pairs of a board: what cannot play is told and does not stop the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cps_agents.arena.meeting import Meeting, Result, attempt
from cps_agents.arena.play import Report, silent
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError, explain
from cps_agents.league.league import League, Plan, check_anybody, entrants, line_up
from cps_agents.league.meetings import RETURN, Payoffs
from cps_agents.report.board import Board, Pair
from cps_baselines.arena import Contestant
from cps_baselines.workers import Workers
from cps_envs.core.types import ROLES


def play_board(plan: Plan, store: Store, workers: int, told: Report = silent, most: int | None = None) -> Board:
    """Everybody against everybody, or `most` of each role that stand for the others.

    A pair that cannot play, as with forms that exclude each other, has no result; those who stand for the others can
    all meet.

    Raises:
        CommandError: a name that nothing has, or nobody left of a role.
    """
    with Workers(workers) as pool:
        players, left_out = (entrants if most is None else line_up)(plan, store, pool)
        for role in ROLES:
            check_anybody(role, players, left_out)
        board = Board(plan, some(players["attacker"], most), some(players["defender"], most), left_out, {})
        results, refused = _play(board, store, pool, told)
    board = replace(board, results=results, refused=refused)
    return replace(board, league=_league(board))


def some(players: Sequence[Contestant], most: int | None) -> Sequence[Contestant]:
    """At most so many, evenly from the first to the last."""
    if most is None or len(players) <= most:
        return players
    return [players[place] for place in np.linspace(0, len(players) - 1, most).round().astype(int)]


def _play(board: Board, store: Store, pool: Workers, told: Report) -> tuple[dict[Pair, Result], dict[Pair, str]]:
    results, refused = {}, {}
    left: list[tuple[Pair, Meeting]] = []
    for pair in board.pairs:
        try:
            meeting = board.meeting(*pair)
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


def _league(board: Board) -> League | None:
    """The league of a board on which every pair has played."""
    if len(board.results) < len(board.pairs):
        return None
    shape = (len(board.attackers), len(board.defenders))
    values, cpu_s = np.zeros((*shape, board.plan.episodes)), np.zeros(shape)
    for pair, result in board.results.items():
        values[pair], cpu_s[pair] = result["metrics"][RETURN], result["cpu_s"]
    payoffs = Payoffs(values, cpu_s, 0)
    return League(board.plan, list(board.attackers), list(board.defenders), list(board.left_out), payoffs)
