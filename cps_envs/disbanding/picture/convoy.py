"""The string of platoons laid out for drawing: metres behind the front, and the road wrapped into rows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cps_envs.core.declare.config import bounds
from cps_envs.core.picture.palette import Color, along
from cps_envs.core.picture.vehicle import VEHICLE_M
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.disbanding.controllers import TIME_TOLERANCE
from cps_envs.disbanding.picture.palette import SPEED_SCALE
from cps_envs.disbanding.picture.scene import Scene

BEYOND_M = 15.0  # road shown ahead of the front and behind the rear vehicle
FEWEST_ROWS, MOST_ROWS = 5, 10


@dataclass(frozen=True)
class Convoy:
    """A scene's vehicles along a road that ends BEYOND_M before the front one, wrapped into rows of equal length."""

    scene: Scene
    behind_m: FloatArray  # (M,) from the end of the road back to the front bumper
    human: BoolArray  # (M,) the driver has taken over
    end_m: float  # road position of the end of the road; grows with the travelled distance
    rows: int
    row_m: float  # length of a row

    @property
    def road_m(self) -> float:
        """Length of the road shown."""
        return self.rows * self.row_m

    def color(self, vehicle: int) -> Color:
        """Of a vehicle, by its speed."""
        return along(SPEED_SCALE, float(self.scene.speed[vehicle]) / self.scene.config.max_speed_mps)

    def spans(self) -> FloatArray:
        """Metres behind the end of the road of each platoon's first bumper and last tail, (N, 2)."""
        platoons = self.behind_m.reshape(-1, self.scene.config.vehicles_per_platoon)
        return np.stack([platoons.min(axis=1), platoons.max(axis=1) + VEHICLE_M], axis=1)

    def disbanded(self) -> BoolArray:
        """Which platoons are disbanded by now, (N,) front to rear."""
        return self.scene.disbanding_s <= self.scene.time_s


def lay_out(scene: Scene) -> Convoy:
    """Put the front at the right end of the first row.

    In steady state a row holds one platoon (of more than ten: two or more); rows get longer when the string does.
    """
    config, platoons = scene.config, len(scene.disbanding_s)
    size = config.vehicles_per_platoon
    bumper = scene.position - VEHICLE_M * np.arange(len(scene.position))
    end_m = float(bumper.max()) + BEYOND_M
    behind = end_m - bumper
    per_row = math.ceil(platoons / MOST_ROWS)
    rows = max(math.ceil(platoons / per_row), FEWEST_ROWS)
    spacing = (size - 1) * bounds(config.desired_gap_m)[1] + config.headway_s * config.desired_speed_mps
    steady_m = per_row * (spacing + size * VEHICLE_M)
    return Convoy(
        scene=scene,
        behind_m=behind,
        human=np.repeat(scene.disbanding_s, size) + scene.takeover_delay_s <= scene.time_s + TIME_TOLERANCE,
        end_m=end_m,
        rows=rows,
        row_m=max(steady_m, (float(behind.max()) + VEHICLE_M + BEYOND_M) / rows),
    )
