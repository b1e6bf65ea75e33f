"""What a picture of the building shows."""

from __future__ import annotations

from dataclasses import dataclass

from cps_envs.core.types import BoolArray, FloatArray


@dataclass(frozen=True)
class Scene:
    """One episode at one step; n zones, S sensors, sets of sensors."""

    episode: int  # differs between the episodes of a game
    step: int  # k
    onset: int  # t_0
    temperature: FloatArray  # (n,) C, true
    estimate: FloatArray  # (n,) C, that the controller got one step ago
    heating: FloatArray  # (n,) W, of the last step
    outdoor_c: float  # now
    measured: FloatArray  # (S,) C, before forging
    reading: FloatArray  # (S,) C, after forging
    compromised: BoolArray  # (S,)
    choice: int  # of the defender one step ago: 0 raw readings, 1.. sets, last the model
    ready: bool  # the window is full
    residual: FloatArray  # (sets,) C2, J_a(k)
    mean_residual: FloatArray  # (sets,) C2, Jm_a(k); 0 until ready
    metrics: dict[str, float]
