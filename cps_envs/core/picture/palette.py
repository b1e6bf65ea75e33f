"""Colours that the pictures of all problems share, and the making of colour scales."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Color = tuple[int, int, int]

PAGE: Color = (246, 247, 249)
PANEL: Color = (255, 255, 255)
BORDER: Color = (221, 225, 231)
GRID: Color = (233, 236, 240)
INK: Color = (28, 36, 48)
MUTED: Color = (104, 114, 128)
WHITE: Color = (255, 255, 255)

TRUE: Color = (48, 112, 190)
FALSE: Color = (214, 102, 16)  # what an attack makes of it
BELIEVED: Color = (0, 140, 108)  # what a defender takes for true
DAMAGE: Color = (204, 28, 46)


def color_scale(anchors: Sequence[Color], stops: Sequence[float], levels: int) -> list[Color]:
    """So many colours along the anchors, which lie at `stops`, rising from 0 to 1."""
    steps = np.linspace(0.0, 1.0, levels)
    channels = [np.interp(steps, stops, channel) for channel in zip(*anchors, strict=True)]
    return [(round(red), round(green), round(blue)) for red, green, blue in zip(*channels, strict=True)]


def along(scale: Sequence[Color], share: float) -> Color:
    """The colour at a share of a scale; below 0 and above 1 that of its nearest end."""
    return scale[round(min(max(share, 0.0), 1.0) * (len(scale) - 1))]


def darker(color: Color, share: float = 0.6) -> Color:
    """A colour with its channels multiplied by `share`."""
    return (int(color[0] * share), int(color[1] * share), int(color[2] * share))


def tint(color: Color, share: float, ground: Color = WHITE) -> Color:
    """A colour laid over a ground so thinly that `share` of it remains."""
    red, green, blue = (round(share * top + (1 - share) * below) for top, below in zip(color, ground, strict=True))
    return red, green, blue
