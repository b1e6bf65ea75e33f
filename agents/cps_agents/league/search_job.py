"""One search for a policy's numbers against an opponent, as work that any process can do and that is kept once done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import ClassVar

import numpy as np

from cps_agents.arena.meeting import InVenue, Result
from cps_agents.league.search import Judge, judge_in, run_search
from cps_baselines.searches import SearchSpace
from cps_envs.core.documents import Entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import FloatArray, Role


@dataclass(frozen=True)
class SearchJob(InVenue):
    """A policy of the role whose numbers are searched against one opponent."""

    kind: ClassVar[str] = "answer"
    role: Role
    opponent: str  # reference
    search: SearchSpace
    budget_s: float  # CPU time
    episodes: int  # of a candidate
    most_episodes: int  # of all candidates; 0: as many as the time allows
    first_seed: int
    sources: Mapping[str, str] = field(default_factory=dict)  # see `Meeting`

    @property
    def label(self) -> str:
        """Its name in progress bars."""
        return self.search.name

    def run(self) -> Result:
        """What the search found: `policy`, `score`, `candidates`, `episodes`."""
        judge = judge_in(self.venue, self.role, (self.opponent,))
        forgiving = _forgiving(judge)
        found = run_search(self.search, forgiving, self.budget_s, self.episodes, self.first_seed, self.most_episodes)
        if found.score <= REFUSED:
            judge(found.policy, [self.first_seed])  # says why nobody can play
        return asdict(found)

    def check(self, result: Entry) -> None:
        """A reference with what it was paid and what it took."""
        result["policy"].text()
        result["score"].number()
        for name in ("candidates", "episodes", "cpu_s"):
            result[name].number(0)


REFUSED = -1e9  # the score of a candidate that cannot play


def _forgiving(judge: Judge) -> Judge:
    """A judge for whom the worst candidates are those that the configuration refuses: a platoon that is not there."""

    def judged(policy: str, seeds: Sequence[int]) -> FloatArray:
        try:
            return judge(policy, seeds)
        except ConfigurationError:
            return np.full(len(seeds), REFUSED)

    return judged
