"""Evolution of plans: sequences of actions that are played whatever is seen.

For deterministic problems that begin in a few situations. A search needs no network, so it tries far more episodes than
a learner in the same time, and it explores whole sequences where a policy draws every action anew.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from gymnasium import spaces

from cps_agents.errors import CommandError
from cps_agents.learning.best_episodes import LEAST_GAIN, BestEpisodes
from cps_agents.learning.demonstrations import Demonstrations
from cps_agents.learning.recipe import Recipe
from cps_agents.learning.training_envs import TrainingEnvs
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray

PARENTS = 8  # best plans kept for each start and island
ISLANDS = 8  # searches of the same start that do not know each other until they are merged
MERGED = 0.3  # of the steps, the last ones, in which parents come from any island
FIRST = 200  # episodes of a start on an island before plans descend from others
STICKINESS = 0.8  # of the actions of first plans
MUTATION_RATES = (0.02, 0.06, 0.15)  # of an entry of the plan, one drawn for each plan
COPY_RATE = 0.04  # an entry takes the value of the step before
MOST_STARTS = 2000  # more situations to begin in are none that plans could be kept for


def search_plans(
    envs: TrainingEnvs, recipe: Recipe, best: BestEpisodes, seed: int, report: Callable[[int, float], None]
) -> None:
    """Add what `search_steps` steps of the environments' agents find to the best episodes.

    The recipe's CPU time bounds the search, too.

    Raises:
        CommandError: actions other than MultiDiscrete, or a game that begins differently each time.
    """
    if not isinstance(envs.action_space, spaces.MultiDiscrete):
        raise CommandError(f"plans are searched for MultiDiscrete actions, not {envs.action_space}")
    search = _Search(envs, recipe, best, seed)
    started_s, seen = time.process_time(), envs.reset()
    search.begin(np.ones(envs.num_envs, np.bool_), seen)
    for done in range(0, recipe.search_steps, envs.num_envs):
        search.merged = done >= (1 - MERGED) * recipe.search_steps
        seen = search.step(seen)
        if done // envs.num_envs % 500 == 0:
            report(done, search.best.mean_return())
            if 0 < recipe.most_cpu_s <= time.process_time() - started_s:
                break


class _Search:
    """The plans (K, ISLANDS, PARENTS, T, S) of K starts with their returns, and what each environment plays now."""

    def __init__(self, envs: TrainingEnvs, recipe: Recipe, best: BestEpisodes, seed: int) -> None:
        self.best, self._envs = best, envs
        self._generator = np.random.default_rng(seed)
        self._choices: IntArray = np.asarray(envs.action_space.nvec)  # type: ignore[attr-defined]
        game, held = envs.env.game, recipe.hold * envs.env.game.decision_interval[recipe.role]
        length = -(-game.horizon // held)
        self._starts: dict[bytes, int] = {}
        self._tried: IntArray = np.zeros((0, ISLANDS), np.int64)
        self._plans: IntArray = np.zeros((0, ISLANDS, PARENTS, length, len(self._choices)), np.int64)
        self._returns: FloatArray = np.zeros((0, ISLANDS, PARENTS))
        self._island: IntArray = np.arange(envs.num_envs) % ISLANDS
        self.merged = False
        shape = (envs.num_envs, length)
        self._plan: IntArray = np.zeros((*shape, len(self._choices)), np.int64)
        self._masks: BoolArray | None = None
        self._seen = np.zeros((*shape, *envs.observation_space.shape), np.float32)  # type: ignore[misc]
        self._age: IntArray = np.zeros(envs.num_envs, np.int64)
        self._total: FloatArray = np.zeros(envs.num_envs)
        self._start: IntArray = np.zeros(envs.num_envs, np.int64)

    def begin(self, fresh: BoolArray, seen: Array) -> None:
        """Choose plans for environments that start an episode."""
        envs = np.flatnonzero(fresh)
        self._start[envs] = [self._index(seen[b].tobytes()) for b in envs]
        self._age[envs], self._total[envs] = 0, 0.0
        starts, islands = self._start[envs], self._island[envs]
        descend = self._tried[starts, islands] > FIRST
        self._plan[envs] = np.where(descend[:, None, None], self._children(starts, islands), self._random(len(envs)))
        np.add.at(self._tried, (starts, islands), 1)

    def step(self, seen: Array) -> Array:
        """Play an action of each plan; returns what is seen next."""
        rows = np.arange(len(self._age))
        masks = self._envs.masks()
        actions = self._legal(self._plan[rows, self._age], masks)
        self._plan[rows, self._age], self._seen[rows, self._age] = actions, seen
        if masks is not None:
            if self._masks is None:
                self._masks = np.zeros((len(rows), self._plan.shape[1], masks.shape[1]), np.bool_)
            self._masks[rows, self._age] = masks
        self._envs.step_async(actions)
        after, rewards, done, _ = self._envs.step_wait()
        self._total += rewards
        self._age += 1
        for b in np.flatnonzero(done).tolist():
            self._end(b)
        if done.any():
            self.begin(done, after)
        return after

    def _index(self, key: bytes) -> int:
        if key not in self._starts:
            if len(self._starts) == MOST_STARTS:
                raise CommandError("plans are searched for games that begin in a few situations: this one draws them")
            self._starts[key] = len(self._starts)
            self._tried = np.concatenate([self._tried, np.zeros((1, ISLANDS), np.int64)])
            self._plans = np.concatenate([self._plans, np.zeros((1, *self._plans.shape[1:]), np.int64)])
            self._returns = np.concatenate([self._returns, np.full((1, ISLANDS, PARENTS), -np.inf)])
        return self._starts[key]

    def _end(self, b: int) -> None:
        place, total, age = (self._start[b], self._island[b]), self._total[b], self._age[b]
        worst = int(self._returns[place].argmin())
        if total <= self._returns[place][worst] or np.any(np.abs(total - self._returns[place]) < LEAST_GAIN):
            return  # worse than all, or a copy of one
        masks = None if self._masks is None else self._masks[b, :age].copy()
        episode = Demonstrations(self._seen[b, :age].copy(), self._plan[b, :age].copy(), masks)
        self.best.keep(float(total), episode)
        self._plans[(*place, worst)], self._returns[(*place, worst)] = self._plan[b], total

    def _random(self, count: int) -> IntArray:
        plans = self._drawn(count)
        keeps = self._generator.random(plans.shape) < STICKINESS
        for step in range(1, plans.shape[1]):
            plans[:, step] = np.where(keeps[:, step], plans[:, step - 1], plans[:, step])
        return plans

    def _children(self, starts: IntArray, islands: IntArray) -> IntArray:
        """Two parents' plans, cut at a random step, mutated."""
        mother, father = self._parents(starts, islands), self._parents(starts, islands)
        generator, length = self._generator, self._plans.shape[3]
        cut = generator.integers(length + 1, size=(len(starts), 1, 1))
        plans = np.where(np.arange(length)[:, np.newaxis] < cut, mother, father)
        rate = generator.choice(MUTATION_RATES, size=(len(starts), 1, 1))
        near = np.clip(plans + generator.integers(-1, 2, size=plans.shape), 0, self._choices - 1)
        other = np.where(generator.random(plans.shape) < 0.5, near, self._drawn(len(starts)))
        plans = np.where(generator.random(plans.shape) < rate, other, plans)
        copied = generator.random(plans.shape) < COPY_RATE
        for step in range(1, length):
            plans[:, step] = np.where(copied[:, step], plans[:, step - 1], plans[:, step])
        return plans

    def _parents(self, starts: IntArray, islands: IntArray) -> IntArray:
        """Plans (E, T, S) of the starts, from their islands or, once these are merged, from any."""
        if self.merged:
            islands = self._generator.integers(ISLANDS, size=len(islands))
        return self._plans[starts, islands, self._generator.integers(PARENTS, size=len(starts))]

    def _drawn(self, count: int) -> IntArray:
        return self._generator.integers(self._choices, size=(count, *self._plans.shape[3:]))

    def _legal(self, actions: IntArray, masks: BoolArray | None) -> IntArray:
        """The nearest legal choice of each entry."""
        if masks is None:
            return actions
        ends = np.cumsum(self._choices)[:-1]
        for entry, mask in enumerate(np.split(masks, ends, axis=1)):
            distance = np.abs(np.arange(mask.shape[1]) - actions[:, entry, np.newaxis])
            actions[:, entry] = np.where(mask, distance, mask.shape[1]).argmin(axis=1)
        return actions
