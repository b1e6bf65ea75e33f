"""Searching the numbers of a policy with CMA-ES, within a budget of CPU time: work that is kept once it is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from cps_agents.arena.meeting import InVenue, Result
from cps_agents.zoo.references import form_of
from cps_baselines.evolution import Evolution
from cps_baselines.searches import SearchSpace
from cps_envs.core.declare.config import configure
from cps_envs.core.documents import Entry
from cps_envs.core.errors import ConfigurationError, require
from cps_envs.core.types import SIGN, FloatArray, Role, other
from cps_envs.registration import find_problem

STEP = 0.3  # first standard deviation, of a range
FINALISTS = 6  # candidates that are compared once more at the end, on the same fresh episodes
FINAL_SHARE = 0.2  # of the budget that is kept for them
REFUSED = -1e9  # the score of a candidate that cannot play

Judge = Callable[[str, Sequence[int]], FloatArray]  # a policy's scores on some seeds, (E,); more is better


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

    @cached_property
    def config(self) -> Any:
        """The configuration, in the form that the opponent has learned."""
        config = self.venue.config
        return configure(config, form_of(self.opponent, config))

    def run(self) -> Result:
        """What the search found: `policy`, `score`, `candidates`, `episodes`."""
        found = run_search(self.search, self.judge, self.budget_s, self.episodes, self.first_seed, self.most_episodes)
        if found.score <= REFUSED:
            self.paid(found.policy, [self.first_seed])  # says why nobody can play
        return asdict(found)

    def paid(self, policy: str, seeds: Sequence[int]) -> FloatArray:
        """What a policy of the role is paid on some seeds, (E,)."""
        from cps_envs.core.game.play import play_episodes

        players = {self.role: policy, other(self.role): self.opponent}
        found: FloatArray = (
            SIGN[self.role] * play_episodes(find_problem(self.problem), self.config, players, seeds)["return"]
        )
        return found

    def judge(self, policy: str, seeds: Sequence[int]) -> FloatArray:
        """`paid`; the worst candidates are those that the configuration refuses: a platoon that is not there."""
        try:
            return self.paid(policy, seeds)
        except ConfigurationError:
            return np.full(len(seeds), REFUSED)

    def check(self, result: Entry) -> None:
        """A reference with what it was paid and what it took."""
        result["policy"].text()
        result["score"].number()
        for name in ("candidates", "episodes", "cpu_s"):
            result[name].number(0)


@dataclass(frozen=True)
class Candidate:
    """The best policy that a search has found, and what the search took."""

    search: str
    policy: str
    score: float  # on the last, common episodes of the search
    candidates: int  # policies tried
    episodes: int


@dataclass
class _Account:
    """What has been spent, and the best of each generation."""

    judge: Judge
    ends_s: float  # of this process's CPU clock
    seed: int  # the next one
    most_episodes: float
    candidates: int = 0
    episodes: int = 0

    def play(self, policy: str, seeds: range) -> float:
        self.candidates += 1
        self.episodes += len(seeds)
        return float(self.judge(policy, seeds).mean())

    def draw(self, count: int) -> range:
        self.seed += count
        return range(self.seed - count, self.seed)

    def is_spent(self) -> bool:
        return time.process_time() >= self.ends_s or self.episodes >= self.most_episodes


def run_search(
    search: SearchSpace, judge: Judge, budget_s: float, episodes: int, first_seed: int, most_episodes: int = 0
) -> Candidate:
    """The best policy found in `budget_s` CPU seconds; each generation plays `episodes` new ones, from `first_seed` on.

    At most `most_episodes` in all where that is not 0, but always those of the first candidate.

    The middle of the ranges is tried first, so even the smallest budget has a result. A search that has converged
    begins again elsewhere.
    """
    require("cma", extra="baselines", purpose="searching policies")  # importing it is not charged
    start_s = time.process_time()
    most = (1 - FINAL_SHARE) * most_episodes if most_episodes else np.inf
    account = _Account(judge, start_s + (1 - FINAL_SHARE) * budget_s, first_seed, most)
    names = list(search.ranges)
    low, high = (np.array([search.ranges[name][end] for name in names], np.float64) for end in (0, 1))
    origin = np.array([search.start.get(name, np.mean(search.ranges[name])) for name in names], np.float64)

    def reference(place: FloatArray) -> str:
        return with_options(search.policy, dict(zip(names, low + place[: len(names)] * (high - low), strict=True)))

    shares = (origin - low) / np.where(high > low, high - low, 1.0)
    first = reference(shares)
    best = {first: account.play(first, account.draw(episodes))}
    generator = np.random.default_rng(first_seed)
    while names and not account.is_spent():
        best |= _evolve(account, shares, reference, episodes)
        shares = generator.random(len(names))
    return _final(account, search.name, [first], best, episodes)


def _evolve(
    account: _Account, shares: FloatArray, reference: Callable[[FloatArray], str], episodes: int
) -> dict[str, float]:
    """The best policy of each generation, and the mean of the population, with their scores."""
    place = np.resize(shares, max(len(shares), 2))  # CMA-ES needs two numbers; a second one has no effect
    run = Evolution(np.clip(place, 0.02, 0.98), STEP, seed=account.seed, bounds=(0.0, 1.0))
    best: dict[str, float] = {}

    def judge(points: FloatArray) -> FloatArray | None:
        seeds, scores = account.draw(episodes), dict[str, float]()
        for policy in map(reference, points):
            scores[policy] = account.play(policy, seeds)
            if account.is_spent():
                break
        found = max(scores, key=lambda policy: scores[policy])
        best[found] = scores[found]
        return None if account.is_spent() else np.array([scores[policy] for policy in map(reference, points)])

    while not account.is_spent() and not run.has_converged:
        if (generation := run.step(judge)) is not None:
            best[reference(np.clip(run.mean, 0.0, 1.0))] = float(generation.values.mean())
    return best


def _final(account: _Account, name: str, first: Sequence[str], best: dict[str, float], episodes: int) -> Candidate:
    """The finalists on the same fresh episodes, twice as many as a generation's."""
    late = list(best)[-FINALISTS // 2 :]
    finalists = dict.fromkeys([*first, *late, *sorted(best, key=lambda policy: -best[policy])[: FINALISTS // 2]])
    if np.isfinite(account.most_episodes):  # FINAL_SHARE of them is left
        left = account.most_episodes / (1 - FINAL_SHARE) - account.episodes
        count = max(int(left // (2 * episodes)), 1)
        finalists = dict.fromkeys(sorted(finalists, key=lambda policy: -best[policy])[:count])
    seeds = account.draw(2 * episodes)
    scores = {policy: account.play(policy, seeds) for policy in finalists}
    policy = max(scores, key=lambda each: scores[each])
    return Candidate(name, policy, scores[policy], account.candidates, account.episodes)


def with_options(policy: str, options: dict[str, float]) -> str:
    """A reference with options appended, to four digits."""
    if not options:
        return policy
    texts = [f"{name}={np.format_float_positional(float(f'{value:.4g}'), trim='-')}" for name, value in options.items()]
    return f"{policy}{'&' if '?' in policy else '?'}{'&'.join(texts)}"
