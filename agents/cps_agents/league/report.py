"""A league as tables on the terminal and as files: JSON, CSV, a heat map."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

from cps_agents.arena.statistics import Estimate
from cps_agents.heatmap import draw_matrix
from cps_agents.league.league import League, LeagueStanding, standings, strategies
from cps_agents.league.strategy import mix
from cps_agents.sheet import Cell, Sheet, csv_text, styled
from cps_envs import find_problem
from cps_envs.core.types import ROLES, Role


def document(league: League, machine: Mapping[str, Any], wall_s: float) -> dict[str, Any]:
    """Everything, for machines."""
    table, problem = league.table, find_problem(league.table.venue.problem)
    return {
        **machine,
        "wall_s": round(wall_s, 1),
        "problem": problem.name,
        "version": problem.version,
        "preset": table.venue.preset,
        "overrides": dict(table.venue.overrides),
        "config": asdict(table.venue.config),
        "metric": table.metric,
        "first_seed": table.first_seed,
        "episodes": table.episodes,
        "equilibrium": {
            "value": league.value.mean,
            "low": league.value.low,
            "high": league.value.high,
            "value_of_means": league.equilibrium.value,
            "gap": league.equilibrium.gap,
            **{role: _strategy(found) for role, found in strategies(league).items()},
        },
        "attackers": [_standing(found) for found in standings(league, "attacker")],
        "defenders": [_standing(found) for found in standings(league, "defender")],
        "left_out": [
            {"role": role, "reference": reference, "reason": reason}
            for (role, reference), reason in league.left_out.items()
        ],
        "cells": [
            {**asdict(cell), "values": values, "attacker": attacker, "defender": defender, "cpu_s": cpu_s}
            for attacker, defender, cell, values, cpu_s in _pairs(league)
        ],
    }


def _strategy(shares: Mapping[str, float]) -> dict[str, Any]:
    return {"probabilities": dict(shares), "reference": mix(list(shares), list(shares.values())).reference}


def _standing(found: LeagueStanding) -> dict[str, Any]:
    return {
        "name": found.player.name,
        "reference": found.player.reference,
        "form": dict(found.player.overrides),
        "probability": found.probability,
        "best_opponent": found.best_opponent,
        "payoff": {"mean": found.payoff.mean, "low": found.payoff.low, "high": found.payoff.high},
        "dominated_by": found.dominated_by,
    }


def _pairs(league: League) -> Iterator[tuple[str, str, Estimate, list[float], float]]:
    for i, attacker in enumerate(league.table.attackers):
        for j, defender in enumerate(league.table.defenders):
            values = league.payoffs.values[i, j].tolist()
            yield attacker.name, defender.name, league.cells[i][j], values, float(league.payoffs.cpu_s[i, j])


def rows_as_csv(league: League) -> str:
    """One line per pair."""
    rows = [
        (attacker, defender, league.table.metric, cell.episodes, cell.mean, cell.low, cell.high, cpu_s)
        for attacker, defender, cell, _, cpu_s in _pairs(league)
    ]
    return csv_text(("attacker", "defender", "metric", "episodes", "mean", "low", "high", "cpu_s"), rows)


def tables(league: League) -> list[Sheet]:
    """The matrix, and how each role's policies stand."""
    columns = ["attacker", *(defender.name for defender in league.table.defenders)]
    rows = [
        [attacker.name, *map(stacked, row)] for attacker, row in zip(league.table.attackers, league.cells, strict=True)
    ]
    title = f"{league.table.venue.problem}: {league.table.measured}; mean and 95 % interval"
    return [Sheet(title, columns, rows), *(_standings_table(league, role) for role in ROLES)]


def _standings_table(league: League, role: Role) -> Sheet:
    best, least = ("best defender", "least payoff") if role == "attacker" else ("best attacker", "most payoff")
    rows = [
        (
            found.player.name,
            f"{found.probability:.1%}" if found.probability else "-",
            found.best_opponent,
            stacked(found.payoff),
            dominated_text(found),
        )
        for found in standings(league, role)
    ]
    return Sheet(f"Equilibrium: {role}", (role, "plays", best, least, "dominated by"), rows)


def dominated_text(found: LeagueStanding) -> str:
    """What dominates a policy, in words."""
    return " or ".join(found.dominated_by)


def verdict(league: League) -> str:
    """The value of the game in a sentence."""
    value = league.value
    ends = "" if value.low is None else f", 95 % interval {value.low:.4g} to {value.high:.4g}"
    return f"Value of the game: {value.mean:.4g}{ends}."


def stacked(found: Estimate) -> Cell:
    """A mean above its interval, for a terminal."""
    mean = f"{found.mean:.4g}"
    return mean if found.low is None else styled(f"{found.low:.3g} .. {found.high:.3g}", "dim", f"{mean}\n")


def draw(league: League) -> Any:
    """The matrix as a matplotlib figure, with the equilibrium's probabilities beside the names."""
    means = league.payoffs.means
    texts = [
        [f"{cell.mean:.3g}" + ("" if cell.low is None else f"\n{cell.low:.3g}..{cell.high:.3g}") for cell in row]
        for row in league.cells
    ]
    rows, columns = ([_heading(found) for found in standings(league, role)] for role in ROLES)
    table, venue = league.table, league.table.venue
    title = (
        f"{venue.problem}, preset {venue.preset}: {table.metric} of {table.episodes} episodes, mean and 95 % interval"
    )
    limits = (min(float(means.min()), 0.0), max(float(means.max()), 1e-9))
    return draw_matrix(means, texts, rows, columns, title=f"{title}\n{verdict(league)}", axis="defender", limits=limits)


def _heading(found: LeagueStanding) -> str:
    return f"{found.player.name}\nplays {found.probability:.0%}" if found.probability else found.player.name
