"""Colours of the platoons on the test bed, rear to front, and of what disbands."""

from __future__ import annotations

from cps_envs.core.picture.palette import Color
from cps_envs.disbanding.picture.palette import DISBANDED

PLATOONS: tuple[Color, ...] = ((30, 136, 112), (43, 101, 184), (126, 87, 168), (92, 104, 122))


def platoon_color(platoon: int, disbanded: bool) -> Color:
    """Colour of the paper's platoon 1 (rear), 2, ..."""
    return DISBANDED if disbanded else PLATOONS[(platoon - 1) % len(PLATOONS)]
