"""What the colours of the platoon's picture stand for."""

from __future__ import annotations

from cps_envs.core.picture.palette import Color

ATTACKER: Color = (224, 112, 24)
AHEAD: Color = (48, 112, 190)  # of the attacker: the gap to that vehicle, and its speed
BEHIND: Color = (128, 70, 180)
OTHER: Color = (150, 164, 184)
ALARM: Color = (255, 196, 0)
WANTED: Color = (40, 126, 66)  # gaps of grown separations
BRAKING: Color = (84, 97, 117)  # effort below zero
BRAKE_LIGHT: Color = (255, 60, 60)
LAW_COLORS: dict[str, Color] = {
    "linear": (150, 172, 200),
    "sliding": (84, 170, 232),
    "front": (104, 196, 128),
    "rear": (196, 150, 232),
    "human": (240, 232, 208),
    "commanded": (96, 200, 200),
    "attacker": ATTACKER,
}
