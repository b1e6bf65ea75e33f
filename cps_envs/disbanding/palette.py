"""Colours of the pictures; the speed scale goes in perceptually even steps from red (0 m/s) to blue (top speed)."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import Array, FloatArray

Color = tuple[int, int, int]

PAGE: Color = (246, 247, 249)
PANEL: Color = (255, 255, 255)
BORDER: Color = (221, 225, 231)
GRID: Color = (233, 236, 240)
INK: Color = (28, 36, 48)
MUTED: Color = (104, 114, 128)
ASPHALT: Color = (58, 64, 74)
SHOULDER: Color = (84, 91, 102)
MARKING: Color = (176, 183, 193)
INTACT: Color = (84, 97, 117)
DISBANDED: Color = (201, 84, 16)
WHITE: Color = (255, 255, 255)

LEVELS = 64  # colours of the speed scale
_STOPS = (0.0, 0.150, 0.423, 0.680, 1.0)  # where the anchors lie at equal distances along the path in OKLab
_ANCHORS = ((204, 28, 46), (232, 92, 52), (246, 186, 76), (92, 190, 160), (48, 112, 190))


def _scale() -> list[Color]:
    steps = np.linspace(0.0, 1.0, LEVELS)
    channels = [np.interp(steps, _STOPS, channel) for channel in zip(*_ANCHORS, strict=True)]
    return [(round(red), round(green), round(blue)) for red, green, blue in zip(*channels, strict=True)]


SPEED_SCALE = _scale()


def speed_level(speed: FloatArray, max_speed_mps: float) -> Array:
    """Index into SPEED_SCALE of each speed (m/s)."""
    return np.clip(np.rint(speed / max_speed_mps * (LEVELS - 1)), 0, LEVELS - 1).astype(np.int64)


def darker(color: Color, share: float = 0.6) -> Color:
    """A colour with its channels multiplied by `share`."""
    return (int(color[0] * share), int(color[1] * share), int(color[2] * share))
