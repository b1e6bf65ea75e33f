"""The pieces of work of a contest: screening constant actions, and searching responses; and what came out of it.

That is who took part, and what every meeting's episodes paid.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

import numpy as np

from cps_agents.arena.meeting import InVenue, Result
from cps_agents.contest.search import Judge, run_search
from cps_agents.zoo.references import form_of
from cps_baselines.arena import Contestant, Venue
from cps_baselines.contest import Contest, Search, Side, Variant
from cps_envs.core.config import configure
from cps_envs.core.documents import Entry
from cps_envs.core.types import SIGN, FloatArray, Role, other
from cps_envs.registration import find_problem


def judge_in(venue: Venue, role: Role, rivals: Sequence[str]) -> Judge:
    """Scores of a role's policies against rivals: what the role is paid, the mean over the rivals, (E,)."""
    from cps_envs.core.play import play_episodes

    problem, config = find_problem(venue.problem), venue.config
    configs = {rival: configure(config, form_of(rival, config)) for rival in rivals}

    def scores(policy: str, seeds: Sequence[int]) -> FloatArray:
        paid = [
            play_episodes(problem, configs[rival], {role: policy, other(role): rival}, seeds)["return"]
            for rival in rivals
        ]
        found: FloatArray = SIGN[role] * np.mean(paid, axis=0)
        return found

    return scores


@dataclass(frozen=True)
class Screening(InVenue):
    """Some policies of a role on a few episodes against each rival."""

    kind: ClassVar[str] = "screening"
    role: Role
    policies: tuple[str, ...]
    rivals: tuple[str, ...]
    episodes: int
    first_seed: int
    sources: Mapping[str, str] = field(default_factory=dict)  # see `Meeting`

    @property
    def label(self) -> str:
        """For progress."""
        return f"constants of the {self.role} {self.policies[0]}"[:80]

    def run(self) -> Result:
        """`scores` of the policies."""
        judge = judge_in(self.venue, self.role, self.rivals)
        seeds = range(self.first_seed, self.first_seed + self.episodes)
        return {"scores": [float(judge(policy, seeds).mean()) for policy in self.policies]}

    def check(self, result: Entry) -> None:
        """A finite score for each policy."""
        result["scores"].numbers(len(self.policies))
        result["cpu_s"].number(0)


@dataclass(frozen=True)
class Response(InVenue):
    """A role's searches against fixed rivals; they share the budget equally."""

    kind: ClassVar[str] = "response"
    role: Role
    name: str  # whom it responds to
    rivals: tuple[str, ...]
    searches: tuple[Search, ...]
    budget_s: float  # CPU time
    episodes: int  # of a candidate, against each rival
    first_seed: int
    sources: Mapping[str, str] = field(default_factory=dict)  # see `Meeting`

    @property
    def label(self) -> str:
        """For progress."""
        return f"{self.role} responds to {self.name}"

    def run(self) -> Result:
        """`found`: what each search found."""
        judge = judge_in(self.venue, self.role, self.rivals)
        share_s = self.budget_s / len(self.searches)
        found = [run_search(search, judge, share_s, self.episodes, self.first_seed) for search in self.searches]
        return {"found": [asdict(each) for each in found]}

    def check(self, result: Entry) -> None:
        """What each search found."""
        if len(found := result["found"].rows()) != len(self.searches):
            raise result["found"].error(f"a list of {len(self.searches)} findings")
        for each in found:
            each["policy"].text()
            each["score"].number()
        result["cpu_s"].number(0)


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
