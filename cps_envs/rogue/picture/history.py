"""What the viewer has seen of an episode, as curves over time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.picture.history import History
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.rogue.picture.scene import Scene

MOST_POINTS = 300  # of a curve


class Traces(NamedTuple):
    """What is plotted of an episode, at k moments."""

    time_s: FloatArray  # (k,)
    effort: FloatArray  # (k,)
    speed: FloatArray  # (k, n) m/s
    gap: FloatArray  # (k, n - 1) m, between bumpers
    damage: FloatArray  # (k, n - 1) of each pair


class Recording:
    """The moments of an episode up to the present one."""

    def __init__(self) -> None:
        self._history = History(MOST_POINTS)

    def add(self, scene: Scene) -> None:
        """Take a moment in; another episode, or time that goes back, begins a new recording."""
        row = np.concatenate([[scene.time_s, scene.effort], scene.speed, scene.gap, scene.damage])
        self._history.add(scene.episode, (scene.time_s,), row)

    def traces(self) -> Traces:
        """What was seen, thinned in long episodes; always with the last moment."""
        return traces_of(self._history.rows())

    def damaged_since(self, time_s: float) -> BoolArray:
        """Pairs (n - 1,) that have taken damage since the last moment before a time."""
        seen = traces_of(self._history.every())
        first = max(int(np.searchsorted(seen.time_s, time_s)) - 1, 0)
        damaged: BoolArray = seen.damage[-1] > seen.damage[first]
        return damaged


def traces_of(rows: FloatArray) -> Traces:
    """The parts of rows (k, 3 n)."""
    n = rows.shape[1] // 3
    return Traces(rows[:, 0], rows[:, 1], rows[:, 2 : n + 2], rows[:, n + 2 : 2 * n + 1], rows[:, 2 * n + 1 :])
