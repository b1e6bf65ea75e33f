"""A canvas that keeps what is drawn as plain data, for pictures that are sharp at any size."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from cps_envs.core.picture.canvas import OVERSAMPLING, Box, Canvas, Point, whole
from cps_envs.core.picture.lettering import BASELINE, EM, width_of
from cps_envs.core.picture.palette import Color

FEW = 6  # points, which are rounded quicker one by one
Shape: TypeAlias = tuple[Any, ...]  # the name of a kind, then what it needs; see the methods of `Recorder`


@dataclass(frozen=True)
class Sprite:
    """A small picture that is drawn in many places; its shapes are OVERSAMPLING times too large."""

    size: tuple[int, int]  # pixels
    shapes: tuple[Shape, ...]


class Recorder(Canvas):
    """A canvas that lists the shapes of a picture, in the order in which they are painted. It needs no pygame.

    `shapes` are those since the last `fill`, which covers everything; `sprites` are those that shapes name.
    """

    def __init__(self, width: int, height: int) -> None:
        self.size = (width, height)
        self.shapes: list[Shape] = []
        self.sprites: list[Sprite] = []
        self._places: dict[Hashable, int] = {}
        self._clip: Shape = ()

    def fill(self, color: Color) -> None:
        """("fill", colour)."""
        self.shapes = [("fill", _web(color))]

    def box(self, box: Box, color: Color, *, radius: int = 0, border: int = 0) -> None:
        """("box", colour, left, top, width, height, radius, border)."""
        self.shapes.append(("box", _web(color), *whole(box), radius, border))

    def polygon(self, points: Sequence[Point], color: Color) -> None:
        """("polygon", colour, x, y, x, y, ...)."""
        self.shapes.append(("polygon", _web(color), *_flat(points)))

    def path(self, points: Sequence[Point], color: Color) -> None:
        """("path", colour, x, y, x, y, ...)."""
        self.shapes.append(("path", _web(color), *_flat(points)))

    def line(self, begin: Point, end: Point, color: Color, thickness: float) -> None:
        """("line", colour, thickness, x, y, x, y)."""
        self.shapes.append(("line", _web(color), _short(thickness), *_flat([begin, end])))

    def circle(self, center: Point, radius: float, color: Color) -> None:
        """("circle", colour, radius, x, y)."""
        self.shapes.append(("circle", _web(color), _short(radius), *_flat([center])))

    def dashes(self, box: Box, color: Color, *, period: float, length: float, phase: float = 0.0) -> None:
        """("dashes", colour, left, top, width, height, period, length, phase), with a phase below the period."""
        numbers = (_short(each) for each in (period, length, phase % period))
        self.shapes.append(("dashes", _web(color), *whole(box), *numbers))

    def text(self, text: str, at: Point, color: Color, size: int, *, align: float = 0.0) -> float:
        """("text", colour, letters' size, left, baseline, width, text)."""
        width = width_of(text, size)
        left, baseline = at[0] - align * width, at[1] + BASELINE * EM * size
        numbers = (_short(each) for each in (EM * size, left, baseline, width))
        self.shapes.append(("text", _web(color), *numbers, text))
        return width

    def text_width(self, text: str, color: Color, size: int) -> float:
        """Width in pixels of a line of text."""
        return width_of(text, size)

    def sprite(self, key: Hashable, size: tuple[int, int], at: Point, paint: Callable[[Canvas], None]) -> None:
        """("sprite", number in `sprites`, left, top), in whole pixels as everywhere."""
        if key not in self._places:
            large = Recorder(OVERSAMPLING * size[0], OVERSAMPLING * size[1])
            paint(large)
            self._places[key] = len(self.sprites)
            self.sprites.append(Sprite(size, tuple(large.shapes)))
        self.shapes.append(("sprite", self._places[key], round(at[0]), round(at[1])))

    @contextmanager
    def within(self, box: Box) -> Iterator[None]:
        """("clip", left, top, width, height) before what is drawn only there, ("clip",) where that ends."""
        before = self._clip
        self._set_clip(whole(box))
        try:
            yield
        finally:
            self._set_clip(before)

    def _set_clip(self, clip: Shape) -> None:
        self._clip = clip
        self.shapes.append(("clip", *clip))


def _web(color: Color) -> str:
    return "#{:02x}{:02x}{:02x}".format(*color)


def _short(value: float) -> float:
    """Rounded to a tenth of a pixel."""
    return round(float(value), 1)


def _flat(points: Sequence[Point]) -> list[float]:
    if len(points) < FEW:
        return [_short(value) for point in points for value in point]
    flat: list[float] = np.round(np.ravel(points), 1).tolist()
    return flat
