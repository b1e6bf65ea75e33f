"""A self-play as a table, JSON and a figure, and its final strategies as lines to play."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cps_agents.arena.statistics import Estimate
from cps_agents.league.bounds import Bounds, LeagueOutcome
from cps_agents.league.report import stacked
from cps_agents.league.self_play import Profile
from cps_agents.sheet import Sheet
from cps_envs.core.errors import require
from cps_envs.core.types import ROLES, Role
from cps_envs.registration import find_problem

FIGURE_INCHES = (8.0, 3.4)


def document(outcome: LeagueOutcome, machine: Mapping[str, Any]) -> dict[str, Any]:
    """Everything, for machines."""
    return {
        **machine,
        "game": outcome.game.to_json(),
        "pool": {role: {player.name: player.reference for player in outcome.pool[role]} for role in ROLES},
        "budget": {"iterations": len(outcome.iterations), "steps": outcome.steps, "cpu_s": round(outcome.cpu_s, 1)},
        "iterations": [
            {
                "iteration": iteration.number + 1,
                **_profile(iteration.profile, bounds),
                "responses": {role: asdict(found) for role, found in iteration.responses.items()},
            }
            for iteration, bounds in zip(outcome.iterations, outcome.bounds, strict=True)
        ],
        "final": _profile(outcome.final, outcome.final_bounds),
    }


def _profile(profile: Profile, bounds: Bounds) -> dict[str, Any]:
    strategies = {role: {**asdict(found), "reference": found.reference} for role, found in profile.items()}
    return {"profile": strategies, "bounds": asdict(bounds)}


def table(outcome: LeagueOutcome) -> Sheet:
    """One line per round: its profile, judged by all policies found."""
    names = [*(str(iteration.number + 1) for iteration in outcome.iterations), "final"]
    rows = [
        (
            name,
            *map(stacked, (found.value, found.attacker_gain, found.defender_gain, found.exploitability)),
            "-" if found.at_most is None else f"{found.at_most:.4g}",
            f"{found.best_attacker}\n{found.best_defender}",
        )
        for name, found in zip(names, [*outcome.bounds, outcome.final_bounds], strict=True)
    ]
    columns = ("round", "return", "an attacker gains", "a defender gains", "both", "both, at most", "best responses")
    title = f"{outcome.game.venue.problem}: the attacker's return ({_unit(outcome)}), and what a best response gains"
    return Sheet(title, columns, rows)


def tell_round(outcome: LeagueOutcome) -> str:
    """The last round in a sentence each."""
    found, number = outcome.bounds[-1], len(outcome.bounds)
    return (
        f"Round {number}: the attacker's return is {found.value:.4g} {_unit(outcome)} when both play. "
        f"Against the defender's mixture {found.best_attacker} gains {found.attacker_gain:.4g}; "
        f"against the attacker's {found.best_defender} gains {found.defender_gain:.4g}."
    )


def strategy_line(outcome: LeagueOutcome, role: Role) -> str:
    """What a role's final strategy plays, by the names of the pool."""
    names, strategy = {each.reference: each.name for each in outcome.pool[role]}, outcome.final[role]
    parts = sorted(zip(strategy.probabilities, strategy.policies, strict=True), reverse=True)
    shown = ", ".join(f"{share:.0%} {names[policy]}" for share, policy in parts)
    return f"The final {role} plays {shown}."


def play_line(outcome: LeagueOutcome, role: Role) -> str:
    """What plays a role's final strategy, in every command."""
    return f"Play it: --{role} {shlex.quote(outcome.final[role].reference)}"


def _unit(outcome: LeagueOutcome) -> str:
    venue = outcome.game.venue
    return find_problem(venue.problem).unit_of(venue.config) or "return"


def draw(outcome: LeagueOutcome) -> Any:
    """Exploitability, and what both sides secure and concede, by iteration, as a matplotlib figure.

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    figures: Any = require("matplotlib.figure", extra="baselines", purpose="drawing self-play")
    figure = figures.Figure(figsize=FIGURE_INCHES, layout="constrained")
    left, right = figure.subplots(1, 2)
    places = np.arange(1, len(outcome.bounds) + 2)
    every = [*outcome.bounds, outcome.final_bounds]
    _line(left, places, [found.exploitability for found in every], "lower bound", "black")
    left.axhline(0.0, color="grey", linewidth=0.8)
    left.set_ylabel("exploitability (return)")
    _line(right, places, [found.conceded for found in every], "defender concedes at least", "tab:red")
    _line(right, places, [found.value for found in every], "both play the profile", "black")
    _line(right, places, [found.secured for found in every], "attacker secures at most", "tab:blue")
    right.set_ylabel("return")
    for axes in (left, right):
        axes.set_xticks(places, [*map(str, places[:-1]), "final"])
        axes.set_xlabel("iteration")
        axes.legend(fontsize=7)
    venue = outcome.game.venue
    figure.suptitle(f"{venue.problem}, preset {venue.preset}: self-play, mean and 95 % interval", fontsize=9)
    return figure


def _line(axes: Any, places: Any, found: Sequence[Estimate], label: str, color: str) -> None:
    means = np.array([each.mean for each in found])
    low = np.array([each.mean if each.low is None else each.low for each in found])
    high = np.array([each.mean if each.high is None else each.high for each in found])
    axes.errorbar(places, means, [means - low, high - means], label=label, color=color, marker="o", capsize=3)
