"""What the viewer draws of one episode."""

from __future__ import annotations

from typing import Any, NamedTuple

from cps_envs.core.types import BoolArray, FloatArray


class Scene(NamedTuple):
    """A snapshot; vehicles in the order of the paper, 1 (last) to n (lead)."""

    episode: int  # differs between the episodes of a game
    time_s: float
    duration_s: float
    task: str  # such as "x4>4"
    target: int  # vehicle
    desired_gap_m: float
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
    max_acceleration_mps2: float
    metrics: dict[str, Any]
