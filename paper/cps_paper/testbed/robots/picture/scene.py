"""What a picture of the test bed shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.state import State
from cps_paper.testbed.robots.config import RobotConfig
from cps_paper.testbed.robots.state import Robots


@dataclass(frozen=True)
class Scene:
    """One episode at one time; M robots and N platoons front to rear; k - 1 control periods are over."""

    config: RobotConfig
    time_s: float
    pose: FloatArray  # (M, 3) x in m, y in m, heading in rad
    desired_arc_m: FloatArray  # (M,) where the law of each robot wants it behind its predecessor; nan where none does
    speeds: FloatArray  # (k, M) m/s, at the start and at the end of each control period
    gaps: FloatArray  # (k, M - 1) m, ahead of all robots but the front one, likewise
    collided: BoolArray  # (M,)
    disbanding_s: FloatArray  # (N,) s, +inf while intact
    metrics: dict[str, float]

    @property
    def disbanded(self) -> BoolArray:
        """The robots (M,) that people drive."""
        disbanded: BoolArray = np.repeat(np.isfinite(self.disbanding_s), self.config.vehicles_per_platoon)
        return disbanded


def scene_of(robots: Robots, string: State, b: int, config: RobotConfig, metrics: dict[str, float]) -> Scene:
    """The scene of an episode."""
    step = int(string.step[b])
    return Scene(
        config=config,
        time_s=step * config.control_period_s,
        pose=robots.pose[b].copy(),
        desired_arc_m=desired_arcs(robots.arc[b], robots.speed[b], string.disbanding_s[b], config),
        speeds=robots.speeds[b, : step + 1].copy(),
        gaps=-np.diff(robots.arcs[b, : step + 1], axis=1),
        collided=string.collided[b].copy(),
        disbanding_s=string.disbanding_s[b].copy(),
        metrics=metrics,
    )


def desired_arcs(arc: FloatArray, speed: FloatArray, disbanding_s: FloatArray, config: RobotConfig) -> FloatArray:
    """Arc positions (M,) in m that keep the desired gap, or a leader's headway, to the robot ahead."""
    size = config.vehicles_per_platoon
    leads, driven = np.arange(len(arc)) % size == 0, np.repeat(np.isfinite(disbanding_s), size)
    wanted = np.where(leads, config.headway_s * speed, config.desired_gap_m)
    desired: FloatArray = np.where(driven, np.nan, np.append(np.nan, arc[:-1]) - wanted)
    return desired
