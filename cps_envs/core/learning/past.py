"""How running episodes came where they are: the generators that they began with, and every action since.

Played again, these give the same state, bit for bit, of the game, of its players and of agents, whatever these are made
of. Nothing else has to be read from a file: no memory of a policy, and no array in which a kernel finds a place.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from typing import TypeAlias

import numpy as np

from cps_envs.core.compute.generators import Lazy
from cps_envs.core.compute.streams import WORDS
from cps_envs.core.types import Array, BoolArray, IntArray

Arrays: TypeAlias = Mapping[str, Array]
MOST_CHILDREN = 2**31  # of a generator
ODD = np.uint64(1)


class Past:
    """What B episodes have been through, which a vector environment tells it."""

    def __init__(self, episodes: int) -> None:
        self._age: IntArray = np.zeros(episodes, np.int64)  # actions since an episode's begin
        self._streams: Array = np.zeros((episodes, WORDS), np.uint64)  # of their generators, before they began
        self._spawned: IntArray = np.zeros(episodes, np.int64)  # children of these until then
        self._actions: deque[Array] = deque()  # of all rows, the last ones of the oldest episode

    def begin(self, envs: BoolArray, generators: Lazy) -> None:
        """The marked episodes (B,) begin, each with its generator as it is now."""
        rows = envs.nonzero()[0]
        self._streams[rows], self._spawned[rows] = generators.state(rows)
        self._age[rows] = 0
        self._forget()

    def act(self, actions: Array, envs: BoolArray) -> None:
        """All rows have acted (N, ...), which counts in the marked episodes (B,)."""
        self._actions.append(actions.copy())
        self._age[envs] += 1
        self._forget()

    def _forget(self) -> None:
        oldest = int(self._age.max())
        while len(self._actions) > oldest:
            self._actions.popleft()

    def arrays(self) -> dict[str, Array]:
        """All of it; before the first action of all episodes there are none of `actions`."""
        told = {"age": self._age.copy(), "streams": self._streams.copy(), "spawned": self._spawned.copy()}
        return told | ({"actions": np.stack(self._actions)} if self._actions else {})


def start_again(arrays: Arrays, generators: Lazy) -> None:
    """Put generators (B,) where those of a past were.

    Raises:
        ValueError: the arrays are no past of so many episodes.
    """
    count = len(generators)
    wanted = {"age": (np.int64, (count,)), "streams": (np.uint64, (count, WORDS)), "spawned": (np.int64, (count,))}
    for name, (kind, shape) in wanted.items():
        array = arrays[name]
        if array.dtype != kind or array.shape != shape:
            raise ValueError(f"{name} has shape {array.shape} and type {array.dtype}, not {shape} {np.dtype(kind)}")
    age, streams, spawned = (arrays[name] for name in wanted)
    if age.min() < 0 or spawned.min() < 0 or spawned.max() >= MOST_CHILDREN:
        raise ValueError("an episode's age or its generator's children make no sense")
    if not (streams[:, 3] & ODD).all():  # which have a full period; others may draw the same number for ever
        raise ValueError("a generator's increment is even")
    if len(arrays.get("actions", ())) != age.max():
        raise ValueError(f"there are {len(arrays.get('actions', ()))} actions for {age.max()} decisions")
    generators.go_on(streams, spawned)


def moves(arrays: Arrays) -> Iterator[tuple[Array, BoolArray]]:
    """The actions (N, ...) of a past one after the other, and the episodes (B,) in which each counts."""
    actions, age = arrays.get("actions", ()), arrays["age"]
    for place, chosen in enumerate(actions):
        yield chosen, age >= len(actions) - place
