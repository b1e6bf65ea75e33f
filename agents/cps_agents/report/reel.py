"""An episode's pictures as compact data: each shape once, and of each picture what differs from the one before."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from cps_envs.core.picture.recording import Recorder, Shape

LONG = 10  # numbers from which a line is kept as the continuation of an earlier one
CONTINUES = {"path": "path+", "polygon": "polygon+"}


def reel_of(recorder: Recorder, pictures: Iterable[Sequence[Shape]]) -> dict[str, Any]:
    """Pictures of one recorder, one after the other, as plain data.

    A picture is a flat list of pairs. (k, n) with n > 0 takes n shapes of the picture before, of which it skips k after
    those taken last; (k, 0) takes a shape of the table, k places after the one taken last. Colours are places in a
    table, too. A long line is (kind with "+", colour, s, n, dx, dy, ...): the first n numbers of shape s, then its own
    as steps from point to point in tenths of a pixel.
    """
    table = _Table()
    frames = [table.take(picture) for picture in pictures]
    sprites = [
        {"size": sprite.size, "shapes": [table.plain(shape) for shape in sprite.shapes]} for sprite in recorder.sprites
    ]
    shapes, colors = table.shapes, list(table.colors)
    return {"size": recorder.size, "sprites": sprites, "shapes": shapes, "frames": frames, "colors": colors}


class _Table:
    """Every shape once, and of each picture what differs from the one before."""

    def __init__(self) -> None:
        self.colors: dict[str, int] = {}
        self.shapes: list[list[Any]] = []
        self._places: dict[Shape, int] = {}
        self._latest: dict[tuple[Any, ...], tuple[int, Shape]] = {}  # the last line of a colour from a point on
        self._before: list[int] = []
        self._taken = 0  # the shape of the table that was taken last

    def take(self, picture: Sequence[Shape]) -> list[int]:
        """The next picture as pairs."""
        now = [self._place(shape) for shape in picture]
        pairs = self._relative(_difference(self._before, now))
        self._before = now
        return pairs

    def _relative(self, pairs: Sequence[Sequence[int]]) -> list[int]:
        """The pairs with places counted from those before, which are small numbers."""
        found, end = [], 0
        for place, count in pairs:
            if count:
                found += [place - end, count]
                end = place + count
            else:
                found += [place - self._taken, 0]
                self._taken = place
        return found

    def _place(self, shape: Shape) -> int:
        if shape not in self._places:
            self._places[shape] = len(self.shapes)
            self.shapes.append(self._continued(shape) if len(shape) > LONG else self.plain(shape))
        return self._places[shape]

    def plain(self, shape: Shape) -> list[Any]:
        """A shape with its colour as a place in the table."""
        kind, *rest = shape
        if rest and isinstance(rest[0], str):  # a colour comes first where there is one
            rest[0] = self.colors.setdefault(rest[0], len(self.colors))
        return [kind, *rest]

    def _continued(self, shape: Shape) -> list[Any]:
        plain = self.plain(shape)
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


def _difference(before: Sequence[int], now: Sequence[int]) -> list[list[int]]:
    """The pairs, with absolute places, that make a picture from the one before."""
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
    return pairs
