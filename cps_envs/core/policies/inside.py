"""What games, adapters and policies offer for playing inside a kernel: functions of one environment of a batch.

Where they exist, a GPU plays whole decisions with them, see `core.learning.card`. An environment is then a batch of
one: arrays (1, ...) cut out of arrays (B, ...), and `known` arrays that all share. All functions are `inlined`, or
kernels; they are the ones with which the NumPy side plays too, so that nothing is stated twice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import Array, BoolArray, Role


class Alone(NamedTuple):
    """A single array: an action that is always taken, or nothing, as kernels take no empty tuples."""

    value: Array


@inlined
def begin_blank(known: Any, memory: Any, stream: Array) -> None:
    """Begin an episode with nothing to forget."""


@inlined
def always_active(known: Any, memory: Any, seen: Array, active: BoolArray) -> None:
    """Mark all agents (1, A)."""
    active[:] = True


@inlined
def stay(known: Any, memory: Any, seen: Array, action: Array) -> None:
    """Leave the action (1, ...), which is the neutral one at first."""


@inlined
def take_known(known: Alone, memory: Any, seen: Array, action: Array) -> None:
    """Take the one action (k,) that is known."""
    for i in range(known.value.size):
        action[0, i] = known.value[i]


@dataclass(frozen=True)
class InsidePhysics:
    """How a game moves."""

    held: Any  # a named tuple of arrays, or of such tuples
    reset: Callable[..., None]  # (held, streams (1, 6), envs (1,)): an episode begins
    advance: Callable[..., None]  # (held, attack, defense, envs (1,), payoff (1,)): one game step; payoff is added to
    observe: Mapping[Role, Callable[..., None]]  # (held, observation (1, n))


@dataclass(frozen=True)
class InsideAdapter:
    """How an adapter with A agents translates."""

    known: Any  # a named tuple of arrays
    memory: Callable[[int], Any]  # for so many environments a named tuple of arrays (B, ...)
    begin: Callable[..., None]  # (known, memory, stream (6,)): an episode begins
    observe: Callable[..., None]  # (known, memory, seen (1, n), shown (1, A, m))
    active: Callable[..., None]  # (known, memory, seen (1, n), active (1, A))
    act: Callable[..., None]  # (known, memory, seen (1, n), kept (1, A, j), action (1, ...))


@dataclass(frozen=True)
class InsidePolicy:
    """How a policy decides."""

    known: Any
    memory: Callable[[int], Any]
    begin: Callable[..., None]  # (known, memory, stream (6,)): an episode begins; the stream is the policy's own
    act: Callable[..., None]  # (known, memory, seen (1, n), action (1, ...)), which it fills
