"""What the viewer has seen of an episode, moment by moment."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.rogue.picture.scene import Scene

MOST_POINTS = 300  # of a curve


class Course(NamedTuple):
    """The course of an episode at k moments."""

    time_s: FloatArray  # (k,)
    effort: FloatArray  # (k,)
    speed: FloatArray  # (k, n) m/s
    gap: FloatArray  # (k, n - 1) m, between bumpers
    damage: FloatArray  # (k, n - 1) of each pair


class History:
    """Moments of an episode up to the present one; another episode, or time that goes back, begins a new one."""

    def __init__(self) -> None:
        self._episode = -1
        self._count = 0
        self._rows = np.empty((0, 0))

    def add(self, scene: Scene) -> None:
        """Take a moment in; the same moment again replaces what was known of it."""
        row = row_of(scene)
        if scene.episode != self._episode or self._rows.shape[1] != len(row) or scene.time_s < self._time_s[-1]:
            self._episode, self._count, self._rows = scene.episode, 0, np.empty((64, len(row)))
        elif scene.time_s == self._time_s[-1]:
            self._count -= 1
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._rows[self._count] = row
        self._count += 1

    @property
    def _time_s(self) -> FloatArray:
        return self._rows[: self._count, 0]

    def course(self) -> Course:
        """What was seen, thinned in long episodes; always with the last moment."""
        stride = 1 + self._count // MOST_POINTS
        rows = self._rows[np.arange((self._count - 1) % stride, self._count, stride)]
        n = (rows.shape[1]) // 3
        return Course(rows[:, 0], rows[:, 1], rows[:, 2 : n + 2], rows[:, n + 2 : 2 * n + 1], rows[:, 2 * n + 1 :])

    def damaged_since(self, time_s: float) -> BoolArray:
        """Pairs (n - 1,) that have taken damage since the last moment before a time."""
        pairs = self._rows.shape[1] // 3 - 1
        first = max(int(np.searchsorted(self._time_s, time_s)) - 1, 0)
        damaged: BoolArray = self._rows[self._count - 1, -pairs:] > self._rows[first, -pairs:]
        return damaged


def row_of(scene: Scene) -> FloatArray:
    """What a moment adds, (3 n,): time, effort, speeds, gaps, damage."""
    return np.concatenate([[scene.time_s, scene.effort], scene.speed, scene.gap, scene.damage])
