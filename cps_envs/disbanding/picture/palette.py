"""Colours of the road; the speed scale goes in perceptually even steps from red (0 m/s) to blue (top speed)."""

from __future__ import annotations

from cps_envs.core.picture.palette import Color, color_scale

INTACT: Color = (84, 97, 117)
DISBANDED: Color = (201, 84, 16)
WARNED: Color = (245, 208, 66)
UNWARNED: Color = (120, 126, 136)
JAMMED: Color = (214, 48, 132)

LEVELS = 64  # colours of the speed scale
_STOPS = (0.0, 0.150, 0.423, 0.680, 1.0)  # where the anchors lie at equal distances along the path in OKLab
_ANCHORS = ((204, 28, 46), (232, 92, 52), (246, 186, 76), (92, 190, 160), (48, 112, 190))
SPEED_SCALE = color_scale(_ANCHORS, _STOPS, LEVELS)
