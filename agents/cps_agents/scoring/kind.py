"""What an entry is, as it is found and not as somebody says: what it is told, what it holds, what it began with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.scoring.tracks import Track
from cps_agents.zoo.references import form_of
from cps_agents.zoo.wired import WiredPolicy
from cps_envs.core.policies.adapter import advised_by
from cps_envs.core.policies.lookup import PolicyReference, load, parsed, policy_entry
from cps_envs.core.policies.policy import Idle, members_of, privileged_of
from cps_envs.registration import find_problem

SCRATCH, ADVISED, HAND_SET, SEARCHED = "from scratch", "advised", "hand-set", "searched"
PRIVILEGED, CODE = "privileged", "code"
NETWORKS = (SCRATCH, ADVISED)
LADDERS = {  # of kinds that are ranked among one another
    SCRATCH: "network from scratch",
    ADVISED: "network advised",
    HAND_SET: "controller",
    SEARCHED: "controller",
    CODE: "code",
}
KINDS = (*LADDERS, PRIVILEGED)
MOST_NUMBERS = 10**6


@dataclass(frozen=True)
class Kind:
    """One of `KINDS`; of an advised network also by what, of searched numbers also how many."""

    name: str
    by: str = ""
    numbers: int = 0

    def __post_init__(self) -> None:
        if self.name not in KINDS or (self.name == ADVISED) != bool(self.by):
            raise CommandError(f"there is no kind {self.name!r} by {self.by!r}: it is one of {', '.join(KINDS)}")
        if (self.name == SEARCHED) != (0 < self.numbers <= MOST_NUMBERS):
            raise CommandError(f"{self.numbers} numbers and the kind {self.name!r} do not fit together")

    def __str__(self) -> str:
        if self.name == SEARCHED:
            return f"tuned by search, {self.numbers} number{'s' * (self.numbers > 1)}"
        return {SCRATCH: "network from scratch", ADVISED: f"network advised by {self.by}"}.get(self.name, self.name)

    @property
    def network(self) -> bool:
        """Whether training seeds count."""
        return self.name in NETWORKS

    @property
    def ranked(self) -> bool:
        """Whether it knows no more than its role observes."""
        return self.name != PRIVILEGED

    @property
    def ladder(self) -> str:
        """Among whom it is ranked; empty for a privileged one."""
        return LADDERS.get(self.name, "")


def kind_of(track: Track, policy: PolicyReference) -> Kind:
    """The kind of a policy by what it is told, its adapters and its numbers; nothing is played.

    A mixture is privileged if one of its policies is, advised if one of its networks or computed policies advises it.

    Raises:
        UnknownNameError, TypeError, ConfigurationError: the policy cannot play the role.
    """
    members = list(members_of(built(track, policy)))
    if any(map(privileged_of, members)):
        return Kind(PRIVILEGED)
    networks = [each for each in members if isinstance(each, WiredPolicy)]
    if networks:
        others = [type(each).__name__ for each in members if not isinstance(each, (WiredPolicy, Idle))]
        advisers = [*filter(None, (adviser(track, each.wired.wiring.adapter) for each in networks)), *others]
        return Kind(ADVISED, by=advisers[0]) if advisers else Kind(SCRATCH)
    if not isinstance(policy, str) or any(each.source for each in parsed(policy).walk()):
        return Kind(CODE)
    searched = sum(getattr(each, "searched_numbers", 0) for each in members)
    numbers = max(searched, sum(1 for each in parsed(policy).walk() for _ in numbers_in(dict(each.options))))
    return Kind(SEARCHED, numbers=numbers) if numbers else Kind(HAND_SET)


def built(track: Track, policy: PolicyReference) -> Any:
    """A policy that is ready to play the role of a track."""
    problem, config = find_problem(track.problem), track.venue.config
    if isinstance(policy, str):
        config = problem.config(track.venue.preset, form_of(policy, config))
    return problem.policy(policy, problem.game(config, 1), track.role)


def adviser(track: Track, adapter: str) -> str:
    """The controller that an adapter plays while a learner takes neutral actions; empty if it bears no such name."""
    entry = policy_entry(track.problem, track.role, adapter)
    return adapter if entry is not None and advised_by(load(entry)) is not None else ""


def numbers_in(value: Any) -> Iterator[float]:
    """The numbers in the options of a policy: nobody can tell them from searched ones."""
    if isinstance(value, (list, tuple, dict)):
        for each in value.values() if isinstance(value, dict) else value:
            yield from numbers_in(each)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield value
