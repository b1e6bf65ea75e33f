"""The final strategies of a self-play as trained policies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cps_agents.league.self_play import MOST_STEPS, strategy_in
from cps_agents.zoo.card import Card
from cps_agents.zoo.merging import without_places
from cps_agents.zoo.mixing import save_mixture
from cps_baselines.arena import Venue
from cps_envs.core.documents import Entry, read_entry
from cps_envs.core.types import ROLES
from cps_envs.registration import find_problem

NAMES = {"attacker": "attack", "defender": "defense"}
JUDGED = {"attacker": "secured", "defender": "conceded"}  # what says how good a role's strategy is
RECORDED = ("mean", "low", "high", "seeds", "episodes")


def ship_mixtures(result: Path, folder: Path) -> list[Card]:
    """Write both final strategies of a `self-play.json` into a folder; returns their cards.

    Raises:
        DamagedFileError: it is no such file.
    """
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
