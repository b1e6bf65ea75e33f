"""What a viewer has seen of an episode, moment by moment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cps_envs.core.types import FloatArray

Curves = dict[str, FloatArray]  # by name the values (k, ...) of moments


class History:
    """Some fields of an episode's scenes up to the present; another episode, or time that goes back, begins anew.

    A moment is what the fields in `moment` say: its time, and whatever else tells two of that time apart.
    """

    def __init__(self, moment: Sequence[str], names: Sequence[str], most_points: int) -> None:
        self._clock, self._names, self._most = moment, (*moment, *names), most_points  # of a curve
        self._episode: int | None = None
        self._moment: tuple[float, ...] = ()
        self._count = 0
        self._rows: Curves = {}

    def add(self, scene: Any) -> None:
        """Take in a scene; the same moment again replaces what was known of it."""
        values = {name: getattr(scene, name) for name in self._names}
        moment = tuple(values[name] for name in self._clock)
        shapes = {name: np.shape(value) for name, value in values.items()}
        same = scene.episode == self._episode and shapes == {name: rows.shape[1:] for name, rows in self._rows.items()}
        if not same or moment[0] < self._moment[0]:
            self._count, self._rows = 0, {name: np.empty((64, *shape)) for name, shape in shapes.items()}
        elif moment == self._moment:
            self._count -= 1
        for name, value in values.items():
            if self._count == len(self._rows[name]):
                self._rows[name] = np.concatenate([self._rows[name], np.empty_like(self._rows[name])])
            self._rows[name][self._count] = value
        self._episode, self._moment, self._count = scene.episode, moment, self._count + 1

    def every(self) -> Curves:
        """By name the values (k, ...) of all moments, as views."""
        return {name: rows[: self._count] for name, rows in self._rows.items()}

    def curves(self) -> Curves:
        """By name the values (k, ...) of moments, thinned in long episodes; always with the first and the last."""
        kept = np.arange(0, self._count, 1 + self._count // self._most)
        if self._count and kept[-1] != self._count - 1:
            kept = np.append(kept, self._count - 1)
        return {name: rows[kept] for name, rows in self._rows.items()}
