"""Whether ordinary learners learn: what each role's models reach beside doing nothing, constants and every rival."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from cps_agents.arena.challenge import Challenge, able, usual
from cps_agents.arena.store import Store
from cps_agents.evaluation import Comparison, Standing, compare
from cps_agents.table import Table
from cps_agents.zoo.references import PREFIX, SB3
from cps_baselines.arena import Venue
from cps_envs import PROBLEMS
from cps_envs.core.policy import RoleSpec
from cps_envs.core.problem import Problem
from cps_envs.core.registration import class_name
from cps_envs.core.training import NATIVE
from cps_envs.core.types import ROLES, Role, other
from cps_envs.core.untrained import choices_of

PRESET = "learning"
LONGEST = 20  # characters of a constant action in a table
MOST_CONSTANTS = 81  # of an adapter; above that they are too many to play
EPISODES: Mapping[str, int] = {"rogue": 200, "fdi": 400, "hvac": 400, "disbanding": 200}  # chosen: seconds each
UNTRAINED, CONSTANTS, ANALYTIC, TRAINED = "start", "best constant", "best analytic", "best trained"
HELD_OUT: Mapping[str, str] = {  # opponents that training does not meet
    "RogueAttack": "sliding_detection",
    "RogueDefense": "contested?against=assigned",
    "FdiAttack": "bank",
    "FdiDefense": "mimic?acceleration_mps2=0.4",
    "HvacAttack": "mtd2",
    "HvacDefense": "shaped",
    "DisbandingAttack": "mpc",
    "DisbandingDefense": "adaptive",
}


@dataclass(frozen=True)
class Reached:
    """What the models of a role reached against an opponent, and what is beside them."""

    name: str  # of the role, such as RogueAttack
    role: Role
    opponent: str
    models: Standing
    rows: Mapping[str, Standing]  # none, random, start, best constant, best analytic, best trained

    def beaten(self) -> list[str]:
        """The rows that the models surely beat, in pairs on the same episodes."""
        sign = 1.0 if self.role == "attacker" else -1.0
        found = []
        for row, standing in self.rows.items():
            gain = self.models.differences.get(standing.policy)
            if gain is not None and gain.excludes_zero and sign * gain.mean > 0:
                found.append(row)
        return found


def role_of(name: str) -> tuple[Problem, Role]:
    """The problem and role of a name such as RogueAttack."""
    return next((each, role) for each in PROBLEMS.values() for role in ROLES if class_name(each, role) == name)


def constants_of(spec: RoleSpec, adapter: str) -> list[str]:
    """A reference to each constant action of an adapter, if they are few; of a continuous one to the neutral action."""
    bound = spec.adapter(adapter)
    choices = choices_of(bound.action_space)
    if not choices:
        return [f"always?adapter={adapter}&action={bound.neutral_action.tolist()}".replace(" ", "")]
    if np.prod(choices) > MOST_CONSTANTS:
        return []
    actions = [list(each) if bound.action_space.shape else each[0] for each in product(*map(range, choices))]
    return [f"always?adapter={adapter}&action={action}".replace(" ", "") for action in actions]


def native_constants(spec: RoleSpec) -> list[str]:
    """A reference to each of the role's own constant actions, if these are single numbers and few."""
    return constants_of(spec, NATIVE) if isinstance(spec.action_space, spaces.Discrete) else []


def judge(
    name: str,
    folder: Path,
    store: Store,
    workers: int,
    *,
    opponent: str = "",
    episodes: int = 0,
    rivals: bool = True,
    report: Callable[[int, int, str], None] = lambda done, total, note: None,
) -> Reached:
    """Judge the models `FOLDER/seed-N/model.zip` on the evaluation seeds 0, 1, ..., which no training meets.

    The best constant, analytic and trained rival are the best on these very episodes, which favours them.
    """
    problem, role = role_of(name)
    venue, rival = Venue(problem.name, PRESET), opponent or problem.opponents[PRESET][other(role)]
    spec = problem.game(venue.config, 1).spec(role)
    training = problem.training[role]
    playing = able(venue, role, usual(venue, role)) if rivals else ()
    names = [each.reference for each in playing if not each.overrides]  # without those made for another configuration
    groups = {
        CONSTANTS: [*constants_of(spec, training.adapter), *native_constants(spec)],
        ANALYTIC: [each for each in names if not each.startswith(PREFIX)],
        TRAINED: [each for each in names if each.startswith(PREFIX)],
    }
    models, start = f"{SB3}{folder}", f"{SB3}{folder / 'seed-0' / 'start.zip'}"
    sampled = "?sampled=true" if training.sampled else ""
    challenge = Challenge(venue, role, rival, episodes or EPISODES.get(problem.name, 100))
    others = ["none", "random", f"{start}{sampled}", *(each for group in groups.values() for each in group)]
    comparison = Comparison([challenge], [f"{models}{sampled}"], list(dict.fromkeys(others)), "return")
    standings, _ = compare(comparison, store, workers, report)
    by_name = {each.policy: each for each in standings}
    rows = {"none": by_name["none"], "random": by_name["random"], UNTRAINED: by_name[f"{start}{sampled}"]}
    for group, members in groups.items():
        known = [by_name[member] for member in members if member not in ("none", "random")]
        if known:
            rows[group] = _best(known, role)
    return Reached(name, role, rival, by_name[f"{models}{sampled}"], rows)


def _best(standings: Sequence[Standing], role: Role) -> Standing:
    sign = 1.0 if role == "attacker" else -1.0
    return max(standings, key=lambda standing: sign * standing.mean.mean)


COLUMNS = ("none", "random", UNTRAINED, CONSTANTS, ANALYTIC, TRAINED)


def table(found: Sequence[Reached], cpu_s: Mapping[str, float], title: str) -> Table:
    """What the attacker is paid, role by role; a star marks what the models surely beat."""
    rows = [
        [
            f"{each.name}\nagainst {_short(each.opponent)}",
            f"{_interval(each.models)}\n{each.models.mean.seeds} x {cpu_s.get(each.name, 0.0):.0f} CPU s",
            *(_cell(each, column) for column in COLUMNS),
        ]
        for each in found
    ]
    caption = (
        "What the attacker is paid: attackers want more, defenders less. Means with 95 % intervals over training seeds "
        "and episodes.",
        "* the ordinary learner is better, in pairs on the same episodes: the interval of the difference excludes 0.",
    )
    return Table(title, ("role", "ordinary learner", *COLUMNS), rows, caption=caption)


def _cell(reached: Reached, column: str) -> str:
    if column not in reached.rows:
        return ""
    standing = reached.rows[column]
    star = "*" if column in reached.beaten() else ""
    named = f"\n{_short(standing.policy)}" if column in (CONSTANTS, ANALYTIC, TRAINED) else ""
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
            "role": each.name,
            "opponent": each.opponent,
            "models": each.models.to_json(),
            "rows": {name: standing.to_json() for name, standing in each.rows.items()},
            "beaten": each.beaten(),
        }
        for each in found
    ]
