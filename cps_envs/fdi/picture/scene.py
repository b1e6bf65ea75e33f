"""What the viewer draws of one episode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.fdi.config import FdiConfig


@dataclass(frozen=True)
class Scene:
    """A snapshot; vehicles in the order of the paper, 1 (last) to n (lead)."""

    config: FdiConfig
    episode: int  # differs between the episodes of a game
    time_s: float
    target: int  # vehicle
    gap: FloatArray  # (n,) true gap ahead of each vehicle, m; of the lead: to its virtual reference
    closing_speed: FloatArray  # (n,) -e_v, m/s
    reported_gap: FloatArray  # (n,) m, in the last step
    reported_closing_speed: FloatArray  # (n,) m/s, in the last step
    used_gap: FloatArray  # (n,) m, what the commands of the last step followed: reported, or what replaced it
    used_closing_speed: FloatArray  # (n,) m/s
    believed_gap: FloatArray  # (n,) m, predicted by the filter for now; NaN where there is none
    believed_closing_speed: FloatArray  # (n,) m/s
    injection: FloatArray  # (R,) last one, m and m/s; front sensors by kind, then rear sensors by kind
    attacked: BoolArray  # (R,) sensors, in the same order
    trusted: BoolArray  # (R,) readings that the defender let pass, in the same order
    attack_from_s: float  # injections work from then on
    command: FloatArray  # (n,) m/s2
    metrics: dict[str, Any]

    @property
    def duration_s(self) -> float:
        """Length of the episode."""
        return self.config.horizon * self.config.dt_s

    @property
    def sensed_s(self) -> float:
        """When the sensors were read: a step before, unless an illegal injection stopped everything."""
        return max(self.time_s - (0.0 if self.metrics["illegal"] else self.config.dt_s), 0.0)
