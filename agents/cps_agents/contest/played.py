"""What came out of a contest: who took part, and what every meeting's episodes paid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cps_baselines.arena import Contestant
from cps_baselines.contest import Contest, Side, Variant
from cps_envs.core.types import SIGN, FloatArray, Role, other

Pair = tuple[str, str]  # names of attacker and defender


@dataclass(frozen=True)
class Effort:
    """How much is spent."""

    budget_s: float = 300.0  # CPU seconds of the searches against each policy
    episodes: int = 0  # of a meeting; as many as the contest says if 0
    screening_episodes: int = 8  # of each constant, against each policy of the other side
    validation_episodes: int = 48  # of each meeting that a choice hangs on
    finalists: int = 3  # constants that are left after the screening
    final_responses: int = 5  # attacks on each defender that are left after the validation
    final_episodes: int = 150  # of each of them, to choose the best response


@dataclass
class Played:
    """What came out in one variant; a meeting's metrics by the names of attacker and defender."""

    contest: Contest
    variant: Variant
    validation: dict[Pair, Mapping[str, FloatArray]] = field(default_factory=dict)
    meetings: dict[Pair, Mapping[str, FloatArray]] = field(default_factory=dict)
    constants: dict[Role, list[Contestant]] = field(default_factory=dict)  # the finalists
    responses: dict[str, Contestant] = field(default_factory=dict)  # to each defender: the one that validation chose
    found: list[Contestant] = field(default_factory=list)  # every attack that was searched
    searched: list[Contestant] = field(default_factory=list)  # defenders that were searched
    searches: list[Mapping[str, Any]] = field(default_factory=list)  # for each: against whom, what, how much was tried
    cpu_s: float = 0.0
    reused: int = 0

    def side(self, role: Role) -> Side:
        """Those of a role."""
        return self.contest.attackers if role == "attacker" else self.contest.defenders

    def rated(self, role: Role) -> list[Contestant]:
        """The registered policies and the informed references of a role."""
        return [*self.side(role).policies, *self.side(role).informed]

    def constant(self, role: Role) -> Contestant | None:
        """The constant action that does best in the validation episodes."""
        choices = self.constants.get(role, [])
        return max(choices, key=lambda each: self.valued(role, each), default=None)

    def values(self, role: Role, contestant: Contestant, metric: str = "return") -> FloatArray:
        """A metric of the evaluation episodes against each policy of the other side, (rivals, E)."""
        return _stack(self.meetings, role, contestant, self.side(other(role)).policies, metric)

    def scores(self, role: Role, contestant: Contestant) -> FloatArray:
        """What the role is paid in the evaluation episodes, the mean over the other side's policies, (E,)."""
        found: FloatArray = SIGN[role] * self.values(role, contestant).mean(axis=0)
        return found

    def valued(self, role: Role, contestant: Contestant) -> float:
        """The mean score in the validation episodes."""
        found = _stack(self.validation, role, contestant, self.side(other(role)).policies, "return")
        return SIGN[role] * float(found.mean())

    def best(self, role: Role, contestants: Sequence[Contestant]) -> Contestant:
        """Whom the validation episodes favour."""
        return max(contestants, key=lambda each: self.valued(role, each))

    def told(self) -> FloatArray:
        """What attackers are paid who are told whom they face: the response to each defender, mean over them, (E,)."""
        names = [defender.name for defender in self.contest.defenders.policies]
        found: FloatArray = np.mean(
            [self.meetings[self.responses[name].name, name]["return"] for name in names], axis=0
        )
        return found


def _stack(
    meetings: Mapping[Pair, Mapping[str, FloatArray]],
    role: Role,
    contestant: Contestant,
    rivals: Sequence[Contestant],
    metric: str,
) -> FloatArray:
    return np.array([meetings[_pair(role, contestant, rival)][metric] for rival in rivals])


def _pair(role: Role, mine: Contestant, rival: Contestant) -> Pair:
    return (mine.name, rival.name) if role == "attacker" else (rival.name, mine.name)
