"""The pieces of work of a contest beside its meetings: screening constant actions, and searching responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import ClassVar

import numpy as np

from cps_agents.arena.meeting import InVenue, Result
from cps_agents.contest.search import Judge, run_search
from cps_agents.zoo.references import form_of
from cps_baselines.arena import Venue
from cps_baselines.contest import Search
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
