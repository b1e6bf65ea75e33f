"""Who takes part in a league, and whether it can."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from cps_agents.catalogue import policies
from cps_agents.errors import CommandError, explain
from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import shipped_names
from cps_agents.zoo.references import PREFIX, form_of
from cps_envs import find_problem
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.lookup import NEED_OPTIONS
from cps_envs.core.problem import Problem
from cps_envs.core.types import Role

ALL = "all"  # stands for the usual policies of a role
LONGEST_NAME = 32


@dataclass(frozen=True)
class Venue:
    """The configuration in which everybody meets; plain data."""

    problem: str
    preset: str
    overrides: Mapping[str, Any] = field(default_factory=dict)

    @property
    def config(self) -> Any:
        """The configuration itself."""
        return find_problem(self.problem).config(self.preset, self.overrides)


@dataclass(frozen=True)
class Player:
    """A policy that takes part."""

    role: Role
    name: str  # in tables
    reference: str
    form: Mapping[str, Any] = field(default_factory=dict)  # overrides: how it sees and acts, where that is its own


@dataclass(frozen=True)
class Admission:
    """Whether a player can play: `refusal` says why not; `privileged` what it must know beyond its observations."""

    refusal: str = ""
    unknown: bool = False  # there is no such policy
    privileged: tuple[str, ...] = ()


def usual(problem: Problem, role: Role) -> list[str]:
    """References of the registered policies of a role and of the shipped trained ones."""
    analytic = [entry.name for entry in policies(problem, role) if entry.name not in NEED_OPTIONS]
    cards = [read_card(SHIPPED / f"{name}.json") for name in shipped_names()]
    return analytic + [f"{PREFIX}{card.name}" for card in cards if (card.problem, card.role) == (problem.name, role)]


def make_players(venue: Venue, role: Role, references: Sequence[str]) -> list[Player]:
    """Players with names of their own; trained policies take their own way to see and act with them.

    Raises:
        UnknownNameError: there is no such trained policy.
    """
    config = venue.config
    names: dict[str, int] = {}
    players = []
    for reference in dict.fromkeys(references):
        name = short_name(reference)
        names[name] = names.get(name, 0) + 1
        unique = name if names[name] == 1 else f"{name} #{names[name]}"
        players.append(Player(role, unique, reference, form_of(reference, config)))
    return players


def short_name(reference: str) -> str:
    """A reference as it is, or its end if it is long."""
    if len(reference) <= LONGEST_NAME:
        return reference
    prefix, colon, path = reference.partition(":")
    if colon and "/" in path and "?" not in prefix:
        parts = path.rstrip("/").split("/")
        return f"{prefix}:{'/'.join(parts[-2:])}"
    return f"{reference[: LONGEST_NAME - 3]}..."


def admit(venue: Venue, entry: tuple[Player, bool]) -> Admission:
    """Build a player and let it make its first decision against nobody.

    `entry` also says whether it has played before; then, and if it is an oracle, which would plan, it is only built.
    """
    player, has_played = entry
    problem = find_problem(venue.problem)
    config = problem.config(venue.preset, {**venue.overrides, **player.form})
    try:
        policy = problem.policy(player.reference, problem.game(config, 1), player.role)
        privileged = tuple(sorted(getattr(policy, "privileged", frozenset())))
        if privileged or has_played:
            return Admission(privileged=privileged)
        match = problem.match(config, 1, {player.role: policy})
        match.reset(np.ones(1, np.bool_), [seeding.np_random(0)[0]])
        match.step({}, np.ones(1, np.bool_), match.game.decision_interval[player.role])
    except Exception as error:
        message = str(error) if isinstance(error, TypeError) else explain(error)
        if message is None:
            raise
        return Admission(message, isinstance(error, UnknownNameError))
    return Admission()


def check_known(player: Player, admission: Admission) -> None:
    """A mistyped name is no policy that cannot play.

    Raises:
        CommandError: there is no such policy.
    """
    if admission.unknown:
        raise CommandError(f"{player.role} {player.reference!r}: {admission.refusal}")
