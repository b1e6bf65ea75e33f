"""One robot's extended Kalman filter: position from the camera, heading and speed from how it moves.

State [x, y, heading, speed]. Written out as loops over four numbers: 54,000 steps an episode are the most of the work.
"""

from __future__ import annotations

import math

from cps_envs.core.compute.kalman import take_in
from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_paper.testbed.robots.state import POSITION_DRIFT_M2, Rules

INITIAL_VARIANCE = 1e-4


@inlined
def predict(estimate: FloatArray, covariance: FloatArray, turning: float, rules: Rules) -> None:
    """One step of the model: the robot turns as ordered and keeps its speed. `covariance` becomes A P A' + Q."""
    dt_s, heading, speed = rules.dt_s, estimate[2], estimate[3]
    cosine, sine = math.cos(heading), math.sin(heading)
    estimate[0] += speed * cosine * dt_s
    estimate[1] += speed * sine * dt_s
    estimate[2] = heading + turning * dt_s
    x_heading, x_speed, y_heading, y_speed = -speed * sine * dt_s, cosine * dt_s, speed * cosine * dt_s, sine * dt_s
    for k in range(4):  # A P: only the first two rows of A differ from the identity
        covariance[0, k] += x_heading * covariance[2, k] + x_speed * covariance[3, k]
        covariance[1, k] += y_heading * covariance[2, k] + y_speed * covariance[3, k]
    for k in range(4):  # (A P) A'
        covariance[k, 0] += x_heading * covariance[k, 2] + x_speed * covariance[k, 3]
        covariance[k, 1] += y_heading * covariance[k, 2] + y_speed * covariance[k, 3]
    covariance[0, 0] += POSITION_DRIFT_M2
    covariance[1, 1] += POSITION_DRIFT_M2
    covariance[2, 2] += rules.heading_drift * rules.heading_drift * dt_s
    covariance[3, 3] += rules.speed_drift * rules.speed_drift * dt_s


@inlined
def correct(estimate: FloatArray, covariance: FloatArray, x: float, y: float, rules: Rules) -> None:
    """Take in what the camera sees (m), x and then y as two scalar measurements; keeps the covariance symmetric."""
    for axis in range(2):
        innovation = (x if axis == 0 else y) - estimate[axis]
        total = covariance[axis, axis] + rules.camera_variance_m2
        column = covariance[0, axis], covariance[1, axis], covariance[2, axis], covariance[3, axis]
        row = covariance[axis, 0], covariance[axis, 1], covariance[axis, 2], covariance[axis, 3]
        take_in(estimate, covariance, column, row, innovation, total)
    for k in range(4):
        for j in range(k):
            covariance[k, j] = covariance[j, k] = (covariance[k, j] + covariance[j, k]) / 2.0
