"""What the colours of the platoon's picture stand for."""

from __future__ import annotations

from cps_envs.core.picture.palette import Color

TRUE: Color = (48, 112, 190)
FALSE: Color = (214, 102, 16)  # reported by an attacked sensor
REPLACED: Color = (0, 140, 108)  # used by the defender instead
TARGET: Color = (118, 62, 176)
DAMAGE: Color = (204, 28, 46)  # collisions and limits
VEHICLE: Color = (150, 172, 200)
FALSES = (FALSE, (120, 56, 12), (228, 170, 28), (190, 48, 116))  # sensors that are attacked together
