"""Who enters an arena: the usual policies of a role, and whether a policy can play a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from gymnasium.utils import seeding

from cps_agents.arena.venue import Venue
from cps_agents.errors import CommandError, explain
from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import shipped_names
from cps_agents.zoo.references import ZOO, form_of
from cps_envs import find_problem
from cps_envs.core.declare.panel import Contestant
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.policies.lookup import NEED_OPTIONS, policy_names
from cps_envs.core.types import Role

ALL = "all"  # stands for the usual policies of a role
LONGEST_NAME = 32


@dataclass(frozen=True)
class Admission:
    """Whether a contestant can play: `refusal` says why not; `privileged` what it must know beyond observations."""

    refusal: str = ""
    unknown: bool = False  # there is no such policy
    privileged: tuple[str, ...] = ()

    @property
    def plays(self) -> bool:
        """Whether it can play and knows no more than it observes."""
        return not (self.refusal or self.privileged)

    @property
    def oracle(self) -> str:
        """Why it does not play unless it is asked for; empty if it does."""
        known = " and its ".join(self.privileged)
        return f"an oracle, which knows its {known}: --oracles lets it in" if known else ""


def wanted(venue: Venue, role: Role, references: Sequence[str] | None) -> list[str]:
    """The references with `all` in full; where there are none, the usual ones."""
    known = usual(venue, role)
    return list(dict.fromkeys(each for name in references or [ALL] for each in (known if name == ALL else [name])))


def usual(venue: Venue, role: Role) -> list[str]:
    """References of the registered policies of a role, of the preset's own one, and of the shipped trained ones.

    Raises:
        ConfigurationError: there is no such preset or field.
    """
    problem = find_problem(venue.problem)
    problem.config(venue.preset, venue.overrides)  # which refuses unknown ones
    registered = [name for name in policy_names(problem.name, role) if name not in NEED_OPTIONS]
    own = [name for name in [problem.opponents[venue.preset][role]] if ":" in name and "?" not in name]
    cards = [read_card(SHIPPED / f"{name}.json") for name in shipped_names()]
    return [
        *registered,
        *own,
        *(f"{ZOO}:{card.name}" for card in cards if (card.problem, card.role) == (problem.name, role)),
    ]


def contestants(venue: Venue, references: Sequence[str]) -> list[Contestant]:
    """Contestants with names of their own; trained policies take their own way to see and act with them.

    Raises:
        UnknownNameError: there is no such trained policy.
    """
    config = venue.config
    names: dict[str, int] = {}
    found = []
    for reference in dict.fromkeys(references):
        name = short_name(reference)
        names[name] = names.get(name, 0) + 1
        unique = name if names[name] == 1 else f"{name} #{names[name]}"
        found.append(Contestant(unique, reference, overrides=form_of(reference, config)))
    return found


def short_name(reference: str) -> str:
    """A reference as it is, or its end if it is long."""
    if len(reference) <= LONGEST_NAME:
        return reference
    prefix, colon, path = reference.partition(":")
    if colon and "/" in path and "?" not in prefix:
        parts = path.rstrip("/").split("/")
        return f"{prefix}:{'/'.join(parts[-2:])}"
    return f"{reference[: LONGEST_NAME - 3]}..."


def admit(venue: Venue, role: Role, contestant: Contestant, *, has_played: bool = False) -> Admission:
    """Build a policy and let it make its first decision against nobody.

    One that has played before, and an oracle, which would plan, are only built.
    """
    problem = find_problem(venue.problem)
    try:
        config = problem.config(venue.preset, {**venue.overrides, **contestant.overrides})
        policy = problem.policy(contestant.reference, problem.game(config, 1), role)
        privileged = tuple(sorted(getattr(policy, "privileged", frozenset())))
        if privileged or has_played:
            return Admission(privileged=privileged)
        match = problem.match(config, 1, {role: policy})
        match.reset(np.ones(1, np.bool_), [seeding.np_random(0)[0]])
        match.step({}, np.ones(1, np.bool_), match.game.decision_interval[role])
    except Exception as error:
        message = str(error) if isinstance(error, TypeError) else explain(error)
        if message is None:
            raise
        return Admission(message, isinstance(error, UnknownNameError))
    return Admission()


def check_known(role: Role, reference: str, admission: Admission) -> None:
    """A mistyped name is no policy that cannot play.

    Raises:
        CommandError: there is no such policy.
    """
    if admission.unknown:
        raise CommandError(f"{role} {reference!r}: {admission.refusal}")


def able(venue: Venue, role: Role, references: Sequence[str]) -> tuple[Contestant, ...]:
    """The contestants that can play a role and know no more than they observe."""
    return tuple(each for each in contestants(venue, references) if admit(venue, role, each).plays)
