"""What the pictures are drawn on: boxes, lines, text and small sprites, whatever becomes of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Sequence
from contextlib import AbstractContextManager

import numpy as np

from cps_envs.core.picture.palette import Color

Box = tuple[float, float, float, float]  # left, top, width, height in pixels
Point = tuple[float, float]
SMALL = 15  # pixels of most letters
OVERSAMPLING = 4  # sprites are painted this much larger and scaled down, which smooths their edges


class Canvas(ABC):
    """What a viewer draws on. Pixels (`PixelCanvas`) and records for the web (`Recorder`) come from the same calls.

    Points lie as in a Box: (0, 0) is the upper left corner of the first pixel.
    """

    @abstractmethod
    def fill(self, color: Color) -> None:
        """Cover everything."""

    @abstractmethod
    def box(self, box: Box, color: Color, *, radius: int = 0, border: int = 0) -> None:
        """A filled box, or only its border."""

    @abstractmethod
    def polygon(self, points: Sequence[Point], color: Color) -> None:
        """A filled polygon."""

    @abstractmethod
    def path(self, points: Sequence[Point], color: Color) -> None:
        """A thin smooth line through at least two points."""

    @abstractmethod
    def line(self, begin: Point, end: Point, color: Color, thickness: float) -> None:
        """A smooth straight line of any thickness in pixels, with round ends."""

    @abstractmethod
    def text(self, text: str, at: Point, color: Color, size: int, *, align: float = 0.0) -> float:
        """One line whose middle has the height of `at`; align 0, 0.5, 1: begins, is centred, ends there.

        Returns its width in pixels.
        """

    @abstractmethod
    def text_width(self, text: str, color: Color, size: int) -> float:
        """Width in pixels of a line of text."""

    @abstractmethod
    def sprite(self, key: Hashable, size: tuple[int, int], at: Point, paint: Callable[[Canvas], None]) -> None:
        """A small picture with its upper left corner at a point; `paint` draws it once for each key.

        `paint` gets a transparent canvas that is OVERSAMPLING times larger.
        """

    @abstractmethod
    def within(self, box: Box) -> AbstractContextManager[None]:
        """Draw only inside a box, which takes the place of an outer one."""

    def cross(self, box: Box, color: Color, thickness: float) -> None:
        """The two diagonals of a box."""
        left, top, width, height = box
        right, bottom, half = left + width, top + height, thickness / 2**0.5
        falling = [(left, top), (left + half, top), (right, bottom - half), (right, bottom)]
        self.polygon([*falling, (right - half, bottom), (left, top + half)], color)
        rising = [(left, bottom), (left, bottom - half), (right - half, top), (right, top)]
        self.polygon([*rising, (right, top + half), (left + half, bottom)], color)

    def circle(self, center: Point, radius: float, color: Color) -> None:
        """A filled smooth circle; its centre lies as the points of a `line`."""
        self.line(center, center, color, 2 * radius)

    def dashes(self, box: Box, color: Color, *, period: float, length: float, phase: float = 0.0) -> None:
        """Dashes in a box from left to right: `length` of every `period` pixels, beginning `phase` from the left."""
        left, top, width, height = box
        with self.within(box):
            for start in np.arange(left + phase % period - period, left + width, period).tolist():
                self.box((start, top, length, height), color)


def legible(period: float) -> float:
    """A period in pixels, or the smallest multiple of it that dashes can be told apart at."""
    return period * max(1.0, float(np.ceil(16.0 / period)))


def whole(box: Box) -> tuple[int, int, int, int]:
    """A box whose edges are rounded to whole pixels, so that neighbours neither overlap nor leave a seam."""
    left, top = round(box[0]), round(box[1])
    return left, top, max(round(box[0] + box[2]) - left, 1), max(round(box[1] + box[3]) - top, 1)
