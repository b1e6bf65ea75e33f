"""A canvas of pixels, drawn off screen with pygame: no display, no window, no global settings."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import numpy as np

from cps_envs.core.errors import require
from cps_envs.core.picture.canvas import OVERSAMPLING, Box, Canvas, Point, whole
from cps_envs.core.picture.palette import Color
from cps_envs.core.types import Array, FloatArray


class PixelCanvas(Canvas):
    """A canvas that becomes an array of pixels.

    Raises:
        MissingExtraError: pygame is not installed.
    """

    def __init__(self, width: int, height: int) -> None:
        self._size = width, height
        self._pygame: Any = require("pygame", extra="render", purpose="drawing frames")
        self._pygame.font.init()
        self._surface = self._pygame.Surface((width, height), depth=32)
        self._fonts: dict[int, Any] = {}
        self._lettering = lru_cache(maxsize=1024)(self._letter)
        self._sprites: dict[Hashable, Any] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._size  # a copy is blank: every picture begins with `fill`

    def fill(self, color: Color) -> None:
        """Cover everything."""
        self._surface.fill(color)

    def box(self, box: Box, color: Color, *, radius: int = 0, border: int = 0) -> None:
        """A filled box, or only its border."""
        if radius or border:
            self._pygame.draw.rect(self._surface, color, whole(box), border, radius)
        else:
            self._surface.fill(color, whole(box))

    def polygon(self, points: Sequence[Point], color: Color) -> None:
        """A filled polygon."""
        self._pygame.draw.polygon(self._surface, color, points)

    def path(self, points: Sequence[Point], color: Color) -> None:
        """A thin smooth line through at least two points."""
        self._pygame.draw.aalines(self._surface, color, False, points)

    def line(self, begin: Point, end: Point, color: Color, thickness: float) -> None:
        """A smooth straight line of any thickness in pixels, with round ends.

        Points lie as in a Box: (0, 0) is the upper left corner of the first pixel.
        """
        reach = thickness / 2 + 1
        corner = np.floor(np.minimum(begin, end) - reach)
        size = np.ceil(np.maximum(begin, end) + reach) - corner
        area = self._pygame.Rect(*corner.astype(int), *size.astype(int)).clip(self._surface.get_clip())
        if area.size[0] * area.size[1] == 0:
            return
        patch = self._pygame.Surface(area.size, self._pygame.SRCALPHA, 32)
        patch.fill(color)
        cover = np.clip((thickness + 1) / 2 - _distance(begin, end, area), 0.0, 1.0)
        self._pygame.surfarray.pixels_alpha(patch)[:] = np.rint(255 * cover).astype(np.uint8)
        self._surface.blit(patch, area.topleft)

    def text(self, text: str, at: Point, color: Color, size: int, *, align: float = 0.0) -> float:
        """One line whose middle has the height of `at`; align 0, 0.5, 1: begins, is centred, ends there.

        Returns its width in pixels.
        """
        image = self._lettering(text, color, size)
        width, height = image.get_size()
        self._surface.blit(image, (round(at[0] - align * width), round(at[1] - height / 2)))
        return float(width)

    def text_width(self, text: str, color: Color, size: int) -> float:
        """Width in pixels of a line of text."""
        return float(self._lettering(text, color, size).get_width())

    def _letter(self, text: str, color: Color, size: int) -> Any:
        """A line of text, scaled down from larger letters: pygame would round the space between small ones."""
        if size not in self._fonts:
            self._fonts[size] = self._pygame.font.Font(None, OVERSAMPLING * size)
        large = self._fonts[size].render(text, True, color)
        width, height = large.get_size()
        return self._pygame.transform.smoothscale(large, (width // OVERSAMPLING, height // OVERSAMPLING))

    def sprite(self, key: Hashable, size: tuple[int, int], at: Point, paint: Callable[[Canvas], None]) -> None:
        """A small picture with its upper left corner at a point; `paint` draws it once for each key.

        `paint` gets a transparent canvas that is OVERSAMPLING times larger.
        """
        if key not in self._sprites:
            large = PixelCanvas(1, 1)
            scaled = (OVERSAMPLING * size[0], OVERSAMPLING * size[1])
            large._surface = self._pygame.Surface(scaled, self._pygame.SRCALPHA, 32)
            paint(large)
            self._sprites[key] = self._pygame.transform.smoothscale(large._surface, size)
        self._surface.blit(self._sprites[key], (round(at[0]), round(at[1])))

    @contextmanager
    def within(self, box: Box) -> Iterator[None]:
        """Draw only inside a box."""
        before = self._surface.get_clip()
        self._surface.set_clip(whole(box))
        try:
            yield
        finally:
            self._surface.set_clip(before)

    def pixels(self) -> Array:
        """The picture as uint8 (H, W, 3)."""
        mapped = self._pygame.surfarray.pixels2d(self._surface).T
        picture = np.empty((*mapped.shape, 3), np.uint8)
        for channel, shift in enumerate(self._surface.get_shifts()[:3]):
            picture[:, :, channel] = mapped >> shift
        return picture


def _distance(begin: Point, end: Point, area: Any) -> FloatArray:
    """Distances (width, height) from the middles of an area's pixels to the nearest point of a straight line."""
    x = (area.left + 0.5 + np.arange(area.width) - begin[0])[:, np.newaxis]
    y = area.top + 0.5 + np.arange(area.height) - begin[1]
    across, down = end[0] - begin[0], end[1] - begin[1]
    share = np.clip((x * across + y * down) / max(across**2 + down**2, 1e-12), 0.0, 1.0)
    distance: FloatArray = np.hypot(x - share * across, y - share * down)
    return distance
