"""What a picture of the string of platoons shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.config import DisbandingConfig


@dataclass(frozen=True)
class Scene:
    """One episode at one time; M vehicles front to rear, N platoons front to rear."""

    config: DisbandingConfig
    time_s: float
    position: FloatArray  # (M,) m
    speed: FloatArray  # (M,) m/s
    disbanding_s: FloatArray  # (N,) s, +inf while intact
    takeover_delay_s: FloatArray  # (M,) s, between disbanding and the driver's taking over
    collided: BoolArray  # (M,)
    metrics: dict[str, float]
    warned: BoolArray | None = None  # (M,) whom the warning has reached; None where a broadcast tells everybody
    jolted: tuple[tuple[int, int], ...] = ()  # platoon from the rear and vehicle from its leader, 1 first, that brake
    jammed_after: int = -1  # the last vehicle ahead of a blocked radio link; -1 if none is

    @property
    def spacing(self) -> FloatArray:
        """Distances (M - 1,) in m between the positions of each vehicle and the one ahead."""
        return -np.diff(self.position)
