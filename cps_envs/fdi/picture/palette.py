"""What the colours of the platoon's picture stand for."""

from __future__ import annotations

from cps_envs.core.picture.palette import FALSE, Color

TARGET: Color = (118, 62, 176)
VEHICLE: Color = (150, 172, 200)
FALSES = (FALSE, (120, 56, 12), (228, 170, 28), (190, 48, 116))  # sensors that are attacked together
