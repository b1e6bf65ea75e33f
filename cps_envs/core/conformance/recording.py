"""Playing an environment of any interface, and comparing what came back bit for bit."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping
from itertools import zip_longest
from typing import Any

import numpy as np
from pettingzoo import ParallelEnv

from cps_envs.core.conformance.actors import Crew
from cps_envs.core.interfaces.agents_vector_env import AgentsVectorEnv
from cps_envs.core.interfaces.vector_env import RoleVectorEnv

EXTRA_STEPS = 3  # of a batch beyond its longest episode, so that environments start anew
BATCHES = (RoleVectorEnv, AgentsVectorEnv)


def episode_steps(env: Any) -> int:
    """The most steps of an episode in an interface; for a batch a few more."""
    if hasattr(env, "interval"):
        steps: int = -(-env.game.horizon // env.interval)
    else:
        steps = env.game.horizon // env.game.decision_interval[env.role] if env.waits else env.decisions
    return steps + EXTRA_STEPS if isinstance(env, BATCHES) else steps


def has_ended(env: Any, result: tuple[Any, ...]) -> bool:
    """Whether an episode is over after a step; a batch goes on."""
    if isinstance(env, BATCHES) or len(result) == 2:
        return False
    return not env.agents if isinstance(env, ParallelEnv) else bool(result[2] or result[3])


def record(env: Any, *, seed: int, boldness: float = 0.7) -> tuple[list[Any], list[tuple[Any, ...]]]:
    """Play an episode with random legal actions: the actions, and copies of all that `reset` and `step` returned."""
    crew = Crew(env, seed, boldness)
    results = [copy.deepcopy(env.reset(seed=seed))]
    actions: list[Any] = []
    while len(actions) < episode_steps(env) and not has_ended(env, results[-1]):
        actions.append(crew.act(results[-1][-1]))
        results.append(copy.deepcopy(env.step(copy.deepcopy(actions[-1]))))
    return actions, results


def replay(env: Any, actions: Iterable[Any], *, seed: int | None = None) -> Iterator[tuple[Any, ...]]:
    """Start an episode, where a seed is given, and go through `actions`; yields the returned objects themselves."""
    if seed is not None:
        yield env.reset(seed=seed)
    for action in actions:
        result = env.step(copy.deepcopy(action))
        yield result
        if has_ended(env, result):
            return


def difference(one: Any, two: Any, path: str = "") -> str | None:
    """Where two nested results differ in value, type or shape; None where they are the same bit for bit."""
    if type(one) in (float, int, bool) and type(one) is type(two):
        return None if one == two else f"{path}: {one!r} against {two!r}"
    if isinstance(one, Mapping) and isinstance(two, Mapping):
        if set(one) != set(two):
            return f"{path} has the keys {sorted(set(one) ^ set(two))} on one side only"
        return _first(difference(one[key], two[key], f"{path}[{key!r}]") for key in one)
    if isinstance(one, (tuple, list)) and isinstance(two, (tuple, list)):
        if len(one) != len(two):
            return f"{path} has {len(one)} items on one side and {len(two)} on the other"
        return _first(difference(a, b, f"{path}[{i}]") for i, (a, b) in enumerate(zip(one, two, strict=True)))
    first, second = np.asarray(one), np.asarray(two)
    if first.dtype == object and first.shape == second.shape and first.ndim:
        return difference(list(first), list(second), path)
    if first.shape != second.shape or first.dtype != second.dtype:
        return f"{path}: {first.dtype}{first.shape} on one side, {second.dtype}{second.shape} on the other"
    if np.array_equal(first, second):
        return None
    return f"{path}: {_excerpt(first, second)}"


def _first(found: Iterable[str | None]) -> str | None:
    return next((text for text in found if text is not None), None)


def _excerpt(first: Any, second: Any) -> str:
    if not first.ndim:
        return f"{first!r} against {second!r}"
    place = tuple(int(i) for i in np.argwhere(first != second)[0])
    return f"{first[place]!r} against {second[place]!r} at entry {place}"


NAMES = {2: ("observation", "info"), 5: ("observation", "reward", "terminated", "truncated", "info")}


def assert_same(one: Iterable[tuple[Any, ...]], two: Iterable[tuple[Any, ...]], message: str) -> None:
    """Compare two runs step by step; the message names the first difference.

    Raises:
        AssertionError: they differ.
    """
    for step, (a, b) in enumerate(zip_longest(one, two, fillvalue=())):
        assert len(a) == len(b), f"{message}: at step {step} one of the two has already ended"
        found = difference(dict(zip(NAMES[len(a)], a, strict=True)), dict(zip(NAMES[len(b)], b, strict=True)))
        assert found is None, f"{message}: at step {step} {found}"
