"""One role against a fixed opponent, on the seeds 0, 1, ..., which training never sees, and what it scores there.

Who enters an arena: the usual policies of a role, and whether a policy can play a configuration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from cps_agents.arena.meeting import Result
from cps_agents.arena.play import Pairing
from cps_agents.catalogue import policies
from cps_agents.errors import CommandError, explain
from cps_agents.zoo.card import SHIPPED, read_card
from cps_agents.zoo.files import shipped_names
from cps_agents.zoo.references import PREFIX, form_of
from cps_baselines.arena import Contestant, Venue
from cps_envs import find_problem
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.lookup import NEED_OPTIONS
from cps_envs.core.types import FloatArray, Role


@dataclass(frozen=True)
class Challenge:
    """A role faces an opponent in a venue."""

    venue: Venue
    role: Role
    opponent: str  # reference
    episodes: int = 50
    first_seed: int = 0

    @property
    def config(self) -> Any:
        """The configuration."""
        return self.venue.config

    def pairing(self, contestant: Contestant, episodes: int = 0) -> Pairing:
        """The contestant, a trained one with every training seed, against the opponent."""
        rival = Contestant(self.opponent)
        attacker, defender = (contestant, rival) if self.role == "attacker" else (rival, contestant)
        count = episodes or self.episodes
        return Pairing(self.venue, attacker, defender, count, self.first_seed, every_seed=self.role)


HAPPENED = ">0"  # after a metric's name: 100 in episodes in which it is above zero, 0 in others


def scores(results: Sequence[Result], metric: str, per: str = "") -> FloatArray:
    """A metric (training seeds, episodes), divided episode by episode by another one if `per` names it.

    The mean of "collided>0" is the percentage of episodes in which `collided` is above zero.

    Raises:
        UnknownNameError: the episodes have no such metric.
        ValueError: the divisor is 0 in some episode.
    """
    if metric.endswith(HAPPENED):
        return np.where(scores(results, metric.removesuffix(HAPPENED)) > 0, 100.0, 0.0)
    for name in (metric, *([per] if per else [])):
        if name not in results[0]["metrics"]:
            raise UnknownNameError(f"there is no metric {name!r}. {near(name, results[0]['metrics'])}")
    values = np.array([result["metrics"][metric] for result in results], np.float64)
    if not per:
        return values
    divisors = np.array([result["metrics"][per] for result in results], np.float64)
    if not divisors.all():
        raise ValueError(f"{per} is 0 in some episode: there is nothing to compare {metric} with")
    share: FloatArray = values / divisors
    return share


ALL = "all"  # stands for the usual policies of a role
LONGEST_NAME = 32


@dataclass(frozen=True)
class Application:
    """A contestant and the role that it should play, before it is known whether it can."""

    role: Role
    contestant: Contestant
    has_played: bool = False  # before, so that it need not show that it can


@dataclass(frozen=True)
class Admission:
    """Whether a contestant can play: `refusal` says why not; `privileged` what it must know beyond observations."""

    refusal: str = ""
    unknown: bool = False  # there is no such policy
    privileged: tuple[str, ...] = ()

    @property
    def oracle(self) -> str:
        """Why it does not play unless it is asked for; empty if it does."""
        known = " and its ".join(self.privileged)
        return f"an oracle, which knows its {known}: --oracles lets it in" if known else ""


def usual(venue: Venue, role: Role) -> list[str]:
    """References of the registered policies of a role, of the preset's own one, and of the shipped trained ones.

    Raises:
        ConfigurationError: there is no such preset or field.
    """
    problem = find_problem(venue.problem)
    problem.config(venue.preset, venue.overrides)  # which refuses unknown ones
    registered = [entry.name for entry in policies(problem, role) if entry.name not in NEED_OPTIONS]
    own = [name for name in [problem.opponents[venue.preset][role]] if ":" in name and "?" not in name]
    cards = [read_card(SHIPPED / f"{name}.json") for name in shipped_names()]
    return [
        *registered,
        *own,
        *(f"{PREFIX}{card.name}" for card in cards if (card.problem, card.role) == (problem.name, role)),
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


def admit(venue: Venue, application: Application) -> Admission:
    """Build a policy and let it make its first decision against nobody.

    One that has played before, and an oracle, which would plan, are only built.
    """
    problem, mine, role = find_problem(venue.problem), application.contestant, application.role
    try:
        config = problem.config(venue.preset, {**venue.overrides, **mine.overrides})
        policy = problem.policy(mine.reference, problem.game(config, 1), role)
        privileged = tuple(sorted(getattr(policy, "privileged", frozenset())))
        if privileged or application.has_played:
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


def check_known(application: Application, admission: Admission) -> None:
    """A mistyped name is no policy that cannot play.

    Raises:
        CommandError: there is no such policy.
    """
    if admission.unknown:
        raise CommandError(f"{application.role} {application.contestant.reference!r}: {admission.refusal}")


def able(venue: Venue, role: Role, references: Sequence[str]) -> tuple[Contestant, ...]:
    """Those that can play a role and know no more than they observe."""
    found = [(each, admit(venue, Application(role, each))) for each in contestants(venue, references)]
    return tuple(each for each, admission in found if not (admission.refusal or admission.privileged))
