"""What a role's learned policies reach beside doing nothing, constants and every rival, on the same episodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.arena.admission import able, usual
from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_agents.errors import CommandError
from cps_agents.evaluation import Standing, compare, is_better
from cps_agents.sheet import Sheet
from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import find
from cps_agents.zoo.references import PREFIX, SB3, is_missing
from cps_baselines.arena import Contestant, Venue
from cps_envs import PROBLEMS
from cps_envs.core.game.problem import Problem
from cps_envs.core.interfaces.registration import class_name
from cps_envs.core.types import ROLES, Role, other
from tools.rivals import declared
from tools.rivals.constants import constants_of, native_constants

PRESET = "learning"
SIDES: Mapping[Role, str] = {"attacker": "attack", "defender": "defense"}
LONGEST = 20  # characters of a constant action in a table
EPISODES: Mapping[str, int] = {"rogue": 200, "fdi": 400, "hvac": 400, "disbanding": 200}  # chosen: seconds each
UNTRAINED, CONSTANTS, ANALYTIC, TRAINED, TOLD = "start", "best constant", "best controller", "best trained", "best told"
HELD_OUT: Mapping[str, tuple[str, ...]] = {  # opponents that training does not meet
    "RogueAttack": ("sliding_detection",),
    "RogueDefense": ("contested?against=assigned",),
    "FdiAttack": ("redundant_cusum", "zoo:fdi-defense"),
    "FdiDefense": ("mimic?acceleration_mps2=0.4", "mimic?acceleration_mps2=0.6"),
    "HvacAttack": ("mtd2",),
    "HvacDefense": ("shaped",),
    "DisbandingAttack": ("mpc",),
    "DisbandingDefense": ("adaptive",),
}


@dataclass(frozen=True)
class Learned:
    """The learned policies of a role: references to all training seeds, and to what they began as."""

    name: str  # of the role, such as RogueAttack
    models: str
    start: str
    cpu_s: float  # of training, the mean over seeds
    adapter: str = ""  # that they play through; empty: the role's usual one

    @classmethod
    def in_folder(cls, name: str, folder: Path, cpu_s: float = 0.0) -> Learned:
        """Models of stable-baselines3, `FOLDER/seed-N/model.zip`, with `start.zip` beside them."""
        problem, role = role_of(name)
        sampled = "?sampled=true" if problem.training[role].sampled else ""
        start = folder / "seed-0" / "start.zip"
        return cls(name, f"{SB3}{folder}{sampled}", f"{SB3}{start}{sampled}", cpu_s)

    @classmethod
    def shipped(cls, name: str) -> Learned:
        """The networks that come with the package, such as `zoo:rogue-attack`.

        Raises:
            CommandError: there are none.
        """
        problem, role = role_of(name)
        reference = f"{PREFIX}{problem.name}-{SIDES[role]}"
        if is_missing(reference):
            raise CommandError(f"no networks of {name} are shipped: train them with `cps-envs train {name}-v0`")
        card = read_card(find(reference.removeprefix(PREFIX)))
        spent = [float(facts.get("cpu_s", 0.0)) for facts in card.seeds.values()]
        start, adapter = f"{reference}?untrained=true", str(card.wiring.get("adapter", ""))
        return cls(name, reference, start, float(np.mean(spent)), adapter)


@dataclass(frozen=True)
class Reached:
    """What the learned policies of a role reached against an opponent, and what is beside them."""

    learned: Learned
    role: Role
    opponent: str
    models: Standing
    rows: Mapping[str, Standing]  # none, random, start, best constant, best controller, best trained, best told
    rivals: Sequence[Standing]  # every controller and every other trained policy

    def beats(self, policy: str) -> bool | None:
        """Whether the models surely beat a policy, in pairs on the same episodes; None: neither is surely better."""
        gain = self.models.differences.get(policy)
        return None if gain is None else is_better(gain, self.role)

    def beaten(self) -> list[str]:
        """The rows that the models surely beat."""
        return [row for row, standing in self.rows.items() if self.beats(standing.policy)]

    def level(self) -> list[str]:
        """The rivals that the models are neither surely better nor surely worse than."""
        return [each.policy for each in self.rivals if self.beats(each.policy) is None]

    def better(self) -> list[str]:
        """The rivals that surely beat the models."""
        return [each.policy for each in self.rivals if self.beats(each.policy) is False]


def role_of(name: str) -> tuple[Problem, Role]:
    """The problem and role of a name such as RogueAttack."""
    return next((each, role) for each in PROBLEMS.values() for role in ROLES if class_name(each, role) == name)


def judge(
    learned: Learned,
    store: Store,
    workers: int,
    *,
    opponent: str = "",
    episodes: int = 0,
    rivals: bool = True,
    report: Callable[[int, int, str], None] = lambda done, total, note: None,
) -> Reached:
    """Judge learned policies on the evaluation seeds 0, 1, ..., which no training meets.

    The best constant, controller, trained and told rival are the best on these very episodes, which favours them.
    """
    problem, role = role_of(learned.name)
    venue, rival = Venue(problem.name, PRESET), opponent or problem.opponents[PRESET][other(role)]
    spec = problem.game(venue.config, 1).spec(role)
    usual = problem.training[role].adapter
    adapters = dict.fromkeys((usual, learned.adapter or usual))
    names = [name for name in rivals_of(venue, role) if name != learned.models] if rivals else []
    groups = {
        CONSTANTS: [*(each for name in adapters for each in constants_of(spec, name)), *native_constants(spec)],
        ANALYTIC: [each for each in names if not each.startswith(PREFIX)],
        TRAINED: [each for each in names if each.startswith(PREFIX)],
        TOLD: told(problem, role) if rivals else [],
    }
    others = ["none", "random", learned.start, *(each for group in groups.values() for each in group)]
    sides = {role: [Contestant(learned.models)], other(role): [Contestant(rival)]}
    bars = list(map(Contestant, dict.fromkeys(others)))
    count = episodes or EPISODES.get(problem.name, 100)
    table = Table(venue, sides["attacker"], sides["defender"], count, judged=role, bars=bars)
    standings, _ = compare(table, store, workers, report)
    by_name = {each.policy: each for each in standings}
    rows = {"none": by_name["none"], "random": by_name["random"], UNTRAINED: by_name[learned.start]}
    for group, members in groups.items():
        known = [by_name[member] for member in members if member not in ("none", "random")]
        if known:
            rows[group] = _best(known, role)
    return Reached(learned, role, rival, by_name[learned.models], rows, [by_name[each] for each in names])


def rivals_of(venue: Venue, role: Role) -> list[str]:
    """Every registered policy of a role that can play and knows no more than it observes, in all declared variants."""
    variants = [each.reference for each in declared(venue.problem, role).policies]
    found = able(venue, role, [*usual(venue, role), *variants])
    return [each.reference for each in found if not each.overrides]  # without those made for another configuration


def told(problem: Problem, role: Role) -> list[str]:
    """The policies of a role that are told what it has to infer."""
    return [each.reference for each in declared(problem.name, role).informed]


def _best(standings: Sequence[Standing], role: Role) -> Standing:
    sign = 1.0 if role == "attacker" else -1.0
    return max(standings, key=lambda standing: sign * standing.mean.mean)


COLUMNS = ("none", "random", UNTRAINED, CONSTANTS, ANALYTIC, TRAINED, TOLD)


def table(found: Sequence[Reached], title: str) -> Sheet:
    """What the attacker is paid, role by role; a star marks what the learned policies surely beat."""
    rows = [
        [
            f"{each.learned.name}\nagainst {_short(each.opponent)}",
            f"{_interval(each.models)}\n{each.models.mean.seeds} x {each.learned.cpu_s:.0f} CPU s",
            *(_cell(each, column) for column in COLUMNS),
            "\n".join([*(f"{_short(name)} (better)" for name in each.better()), *map(_short, each.level())]),
        ]
        for each in found
    ]
    caption = (
        "What the attacker is paid: attackers want more, defenders less. Means with 95 % intervals over training seeds "
        "and episodes.",
        "* the learned policies are better, in pairs on the same episodes: the interval of the difference excludes 0.",
        "Not beaten: controllers and other trained policies for which that cannot be said.",
    )
    return Sheet(title, ("role", "learned", *COLUMNS, "not beaten"), rows, caption=caption)


def _cell(reached: Reached, column: str) -> str:
    if column not in reached.rows:
        return ""
    standing = reached.rows[column]
    star = "*" if column in reached.beaten() else ""
    named = f"\n{_short(standing.policy)}" if column in (CONSTANTS, ANALYTIC, TRAINED, TOLD) else ""
    return f"{standing.mean.mean:.3g}{star}{named}"


def _interval(standing: Standing) -> str:
    low, high = standing.mean.low, standing.mean.high
    around = "" if low is None or high is None else f"\n({low:.3g} to {high:.3g})"
    return f"{standing.mean.mean:.3g}{around}"


def _short(reference: str) -> str:
    name, _, query = reference.partition("?")
    if name == "mixture":
        return "the preset's mixture"
    if name != "always":
        return reference
    action = query.partition("action=")[2]
    return action if len(action) < LONGEST else "neutral"  # of a continuous action only the neutral one plays


def to_json(found: Sequence[Reached]) -> list[dict[str, Any]]:
    """Everything as plain data."""
    return [
        {
            "role": each.learned.name,
            "cpu_s": each.learned.cpu_s,
            "opponent": each.opponent,
            "models": each.models.to_json(),
            "rows": {name: standing.to_json() for name, standing in each.rows.items()},
            "beaten": each.beaten(),
            "level": each.level(),
            "better": each.better(),
        }
        for each in found
    ]
