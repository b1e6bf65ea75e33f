"""An episode's pictures as compact data: each shape once, and of each picture what differs from the one before."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cps_envs.core.picture.recording import Recorder, Shape

LONG = 10  # numbers from which a line is kept as the continuation of an earlier one
CONTINUES = {"path": "path+", "polygon": "polygon+"}


class Reel:
    """Pictures of one size, one after the other.

    As data, a picture is a flat list of pairs. (k, n) with n > 0 takes n shapes from the k-th of the picture before on;
    (k, 0) takes the k-th shape of the table. Colours are places in a table, too. A long line is (kind with "+", colour,
    s, n, dx, dy, ...): the first n numbers of shape s, then its own as steps from point to point in tenths of a pixel.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._colors: dict[str, int] = {}
        self._places: dict[Shape, int] = {}
        self._shapes: list[list[Any]] = []
        self._latest: dict[tuple[Any, ...], tuple[int, Shape]] = {}  # the last line of a colour from a point on
        self._before: list[int] = []
        self._frames: list[list[int]] = []

    def take(self) -> None:
        """Keep the picture that is on the recorder."""
        now = [self._place(shape) for shape in self._recorder.shapes]
        self._frames.append(_difference(self._before, now))
        self._before = now

    def document(self) -> dict[str, Any]:
        """Everything as plain data."""
        sprites = [
            {"size": sprite.size, "shapes": [self._plain(shape) for shape in sprite.shapes]}
            for sprite in self._recorder.sprites
        ]
        return {
            "size": self._recorder.size,
            "sprites": sprites,
            "shapes": self._shapes,
            "frames": self._frames,
            "colors": list(self._colors),
        }

    def _place(self, shape: Shape) -> int:
        if shape not in self._places:
            self._places[shape] = len(self._shapes)
            self._shapes.append(self._continued(shape) if len(shape) > LONG else self._plain(shape))
        return self._places[shape]

    def _plain(self, shape: Shape) -> list[Any]:
        kind, *rest = shape
        if rest and isinstance(rest[0], str):  # a colour comes first where there is one
            rest[0] = self._colors.setdefault(rest[0], len(self._colors))
        return [kind, *rest]

    def _continued(self, shape: Shape) -> list[Any]:
        plain = self._plain(shape)
        if plain[0] not in CONTINUES:
            return plain
        start = shape[:4]  # kind, colour, first point
        base, earlier = self._latest.get(start, (0, ()))
        self._latest[start] = (self._places[shape], shape)
        kept = _common(shape[2:], earlier[2:])
        return [CONTINUES[plain[0]], plain[1], base, kept, *_steps(shape[2:], kept)]


def _common(numbers: Sequence[float], others: Sequence[float]) -> int:
    """How many numbers two lines have in common from the start on, an even count."""
    low, high = 0, min(len(numbers), len(others))
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if numbers[low:middle] == others[low:middle] else (low, middle - 1)
    return low - low % 2


def _steps(numbers: Sequence[float], kept: int) -> list[int]:
    """The points after the first `kept` numbers as steps in tenths; the first of all from (0, 0)."""
    tenths = np.rint(10 * np.array([0.0, 0.0, *numbers])).astype(int)
    steps: list[int] = (tenths[2:] - tenths[:-2])[kept:].tolist()
    return steps


def _difference(before: Sequence[int], now: Sequence[int]) -> list[int]:
    """The pairs that make a picture from the one before."""
    where: dict[int, list[int]] = {}
    for place, shape in enumerate(before):
        where.setdefault(shape, []).append(place)
    pairs: list[list[int]] = []
    for shape in now:
        begin, count = pairs[-1] if pairs else (0, 0)
        if count and begin + count < len(before) and before[begin + count] == shape:
            pairs[-1][1] += 1
        elif shape in where:
            end = begin + count if count else 0
            pairs.append([next((place for place in where[shape] if place >= end), where[shape][0]), 1])
        else:
            pairs.append([shape, 0])
    return [number for pair in pairs for number in pair]
