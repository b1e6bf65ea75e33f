"""The whole platoon with the leader's reference in one narrow strip, however far it has scattered."""

from __future__ import annotations

import numpy as np

from cps_envs.core.picture.canvas import SMALL, Box, Canvas
from cps_envs.core.picture.palette import MUTED, WHITE, tint
from cps_envs.core.picture.vehicle import ASPHALT
from cps_envs.rogue.picture.palette import LAW_COLORS
from cps_envs.rogue.picture.road import window_m
from cps_envs.rogue.picture.scene import Scene

LABEL = 62  # pixels at the right for the length of the strip
MARK = 4  # pixels of a vehicle's length


def draw_overview(canvas: Canvas, scene: Scene, box: Box) -> None:
    """A mark for each vehicle, the reference as an outline, and lighter the part that the road above shows."""
    left, top, width, height = box[0], box[1], box[2] - LABEL, box[3]
    length_m, behind_m = window_m(scene)
    begin_m = float(scene.position[scene.attacker]) - behind_m
    low = min(begin_m, float(scene.position.min()), scene.reference_m)
    high = max(begin_m + length_m, float(scene.position.max()), scene.reference_m)
    scale = (width - 2 * MARK) / (high - low)
    strip = (left, top, width, height)
    canvas.box(strip, ASPHALT, radius=2)
    with canvas.within(strip):
        seen = (left + MARK + (begin_m - low) * scale, top, length_m * scale, height)
        canvas.box(seen, tint(WHITE, 0.22, ASPHALT))
        x = left + MARK + (scene.reference_m - low) * scale
        canvas.box((x - MARK / 2 - 2, top + 1, MARK + 4, height - 2), WHITE, border=1)
        for i in np.argsort(scene.rogue, kind="stable").tolist():
            x, inset = left + MARK + (float(scene.position[i]) - low) * scale, 1 if scene.rogue[i] else 3
            canvas.box((x - MARK / 2, top + inset, MARK, height - 2 * inset), LAW_COLORS[scene.law[i]])
    metres = high - low
    label = f"{metres:.0f} m" if metres < 1000 else f"{metres / 1000:.2f} km"
    canvas.text(label, (left + box[2], top + height / 2 + 1), MUTED, SMALL, align=1)
