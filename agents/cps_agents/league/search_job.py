"""One search for a response, as work that any process can do and that is kept once it is done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import ClassVar

from cps_agents.arena.meeting import InVenue, Result
from cps_agents.contest.jobs import judge_in
from cps_agents.contest.search import run_search
from cps_baselines.contest import Search
from cps_envs.core.documents import Entry
from cps_envs.core.types import Role


@dataclass(frozen=True)
class SearchJob(InVenue):
    """A policy of the role whose numbers are searched against one opponent."""

    kind: ClassVar[str] = "answer"
    role: Role
    opponent: str  # reference
    search: Search
    budget_s: float  # CPU time
    episodes: int  # of a candidate
    most_episodes: int  # of all candidates; 0: as many as the time allows
    first_seed: int
    sources: Mapping[str, str] = field(default_factory=dict)  # see `Meeting`

    @property
    def label(self) -> str:
        """For progress."""
        return self.search.name

    def run(self) -> Result:
        """What the search found: `policy`, `score`, `candidates`, `episodes`."""
        judge = judge_in(self.venue, self.role, (self.opponent,))
        found = run_search(self.search, judge, self.budget_s, self.episodes, self.first_seed, self.most_episodes)
        return asdict(found)

    def check(self, result: Entry) -> None:
        """A reference with what it was paid and what it took."""
        result["policy"].text()
        result["score"].number()
        for name in ("candidates", "episodes", "cpu_s"):
            result[name].number(0)
