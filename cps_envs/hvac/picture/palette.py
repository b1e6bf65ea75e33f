"""What the colours of the building's picture stand for."""

from __future__ import annotations

from cps_envs.core.picture.palette import Color, along, color_scale
from cps_envs.hvac.config import HvacConfig

HEAT: Color = (178, 34, 52)
COOL: Color = (36, 98, 178)
HONEST: Color = (70, 82, 102)  # sensors that nobody forges
WALL: Color = (196, 203, 213)

LEVELS = 101
REACH_C = 10.0  # of the scale on both sides of the reference
_ANCHORS = ((92, 148, 214), (148, 190, 230), (226, 237, 240), (246, 240, 222), (246, 186, 108), (228, 98, 74))
TEMPERATURE_SCALE = color_scale(_ANCHORS, (0.0, 0.25, 0.47, 0.53, 0.75, 1.0), LEVELS)


def middle_c(config: HvacConfig) -> float:
    """The middle of the scale: that of the set-points, C."""
    low_c, high_c = config.reference_range_c
    return 0.5 * (low_c + high_c)


def temperature_color(temperature_c: float, reference_c: float) -> Color:
    """Blue 10 C or more below the reference, pale at it, red 10 C or more above."""
    return along(TEMPERATURE_SCALE, (temperature_c - reference_c + REACH_C) / (2 * REACH_C))
