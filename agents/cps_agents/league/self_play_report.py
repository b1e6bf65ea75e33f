"""A self-play as a table, JSON and a figure, and its final strategies as trained policies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.arena.statistics import Estimate
from cps_agents.errors import CommandError
from cps_agents.league.bounds import Bounds, LeagueOutcome
from cps_agents.league.report import stacked
from cps_agents.league.self_play import MOST_STEPS, Profile, strategy_in
from cps_agents.sheet import Sheet
from cps_agents.zoo.card import Card
from cps_agents.zoo.merging import without_places
from cps_agents.zoo.mixing import save_mixture
from cps_baselines.arena import Venue
from cps_envs.core.documents import Entry, read_entry
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
    columns = ("round", "pay", "an attacker gains", "a defender gains", "both", "both, at most", "best replies")
    title = f"{outcome.game.venue.problem}: what the attacker is paid ({_unit(outcome)}), and what a best reply gains"
    return Sheet(title, columns, rows)


def tell_round(outcome: LeagueOutcome) -> str:
    """The last round in a sentence each."""
    found, number = outcome.bounds[-1], len(outcome.bounds)
    return (
        f"Round {number}: the attacker is paid {found.value:.4g} {_unit(outcome)} when both play. "
        f"Against the defender's mixture {found.best_attacker} gains {found.attacker_gain:.4g}; "
        f"against the attacker's {found.best_defender} gains {found.defender_gain:.4g}."
    )


def strategy_line(outcome: LeagueOutcome, role: Role) -> str:
    """What a role's final strategy plays, by the names of the pool."""
    names, strategy = {each.reference: each.name for each in outcome.pool[role]}, outcome.final[role]
    parts = sorted(zip(strategy.probabilities, strategy.policies, strict=True), reverse=True)
    shown = ", ".join(f"{share:.0%} {names[policy]}" for share, policy in parts)
    return f"The final {role} plays {shown}."


def _unit(outcome: LeagueOutcome) -> str:
    return find_problem(outcome.game.venue.problem).unit or "return"


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


NAMES = {"attacker": "attack", "defender": "defense"}
JUDGED = {"attacker": "secured", "defender": "conceded"}  # what says how good a role's strategy is
RECORDED = ("mean", "low", "high", "seeds", "episodes")


def ship_mixtures(result: Path, folder: Path) -> list[Card]:
    """Write both final strategies of a `self-play.json` into a folder; returns their cards.

    Raises:
        CommandError: it is a folder.
        DamagedFileError: it is no such file.
    """
    if result.is_dir():
        raise CommandError(f"{result} is a folder: give {result / 'self-play.json'}")
    found = read_entry(result, "result of `cps-envs self-play`", "Play it again.")
    game, final, budget = found["game"]["venue"], found["final"], found["budget"]
    venue = Venue(game["problem"].text(), game["preset"].text(), game["overrides"].plain())
    facts = {"steps": budget["steps"].whole(0, MOST_STEPS), "cpu_s": budget["cpu_s"].number(0)}
    folder.mkdir(parents=True, exist_ok=True)
    cards = []
    for role in ROLES:
        strategy = strategy_in(final["profile"][role])
        cards.append(
            save_mixture(
                folder / f"{find_problem(venue.problem).name}-{NAMES[role]}-mixture.json",
                venue,
                role,
                dict(zip(strategy.policies, strategy.probabilities, strict=True)),
                facts,
                {"self-play": _judged(final["bounds"], JUDGED[role])},
                without_places(found["command"].text()),
            )
        )
    return cards


def _judged(bounds: Entry, name: str) -> dict[str, Any]:
    """What the role's strategy secures or concedes, and the gap of both, as rows of a card."""
    titles = {name: f"{name}, against all policies found", "exploitability": "gap of both strategies"}
    found = {title: bounds[each].plain() for each, title in titles.items()}
    return {title: {"metric": "return", **{key: each[key] for key in RECORDED}} for title, each in found.items()}
