"""What a viewer has seen of an episode, moment by moment."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import FloatArray


class History:
    """Rows of numbers of an episode up to the present; another episode, or time that goes back, begins a new one."""

    def __init__(self, most_points: int) -> None:
        self._most = most_points  # of a curve
        self._episode: int | None = None
        self._moment: tuple[float, ...] = ()
        self._count = 0
        self._rows: FloatArray = np.empty((0, 0))

    def add(self, episode: int, moment: tuple[float, ...], row: FloatArray) -> bool:
        """Take in the row (w,) of a moment; the same moment again replaces what was known of it.

        A moment is its time, and whatever else tells two rows of that time apart. Returns whether an episode begins.
        """
        begins = episode != self._episode or self._rows.shape[1] != len(row) or moment[0] < self._moment[0]
        if begins:
            self._count, self._rows = 0, np.empty((64, len(row)))
        elif moment == self._moment:
            self._count -= 1
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._rows[self._count] = row
        self._episode, self._moment, self._count = episode, moment, self._count + 1
        return begins

    def every(self) -> FloatArray:
        """The rows (k, w) of all moments, as a view."""
        return self._rows[: self._count]

    def rows(self) -> FloatArray:
        """The rows (k, w), thinned in long episodes; always with the first and the last."""
        every = self.every()
        kept = np.arange(0, self._count, 1 + self._count // self._most)
        if self._count and kept[-1] != self._count - 1:
            kept = np.append(kept, self._count - 1)
        return every[kept]
