"""What the tests of pictures need to know about a problem."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.types import Array


class Pictured(NamedTuple):
    """A viewer with scenes to draw."""

    viewer: type[Any]
    config: Any
    scenes: Sequence[Any]  # of one episode, the first is its start
    changes: Sequence[Mapping[str, Any]]  # to fields of the shown scene; each must be visible
    sizes: Mapping[str, Callable[[], tuple[Any, Iterable[Any]]]]  # other configurations, with scenes of theirs
    shown: Any = None  # the second scene if left out
    another: Any = None  # a scene of another episode
    options: Mapping[str, Any] = {}  # of the environments that draw


def bumped(values: Array, place: int, amount: float) -> Array:
    """The values with an amount added at a place."""
    return np.where(np.arange(len(values)) == place, values + amount, values)
