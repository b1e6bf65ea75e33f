"""The longest integration step with which the sliding mode is stable (specification 4.2)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from cps_envs.core.config import bounds
from cps_envs.core.types import FloatArray

if TYPE_CHECKING:
    from cps_envs.rogue.config import RogueConfig


def longest_stable_step_s(config: RogueConfig) -> float:
    """2 / (gain * lambda): below it explicit Euler follows the combined controller inside its boundary layer.

    gain = (2 k_1 v_max + a_max + epsilon) / epsilon, 1/s; lambda is the largest eigenvalue of the coupling of the
    vehicles that drive by it, over every position that the attacker may be drawn in, and with it where it drives by the
    same law before its onset.
    """
    layer = config.boundary_layer_mps
    authority = 2 * config.surface_slope_per_s * config.max_speed_mps + config.max_acceleration_mps2
    gain = (authority + layer) / layer
    first, last = (int(end) for end in bounds(config.attacker_index))
    coupling = coupling_matrix(config.num_vehicles)
    everyone = range(config.num_vehicles)
    teams: list[Iterable[int]] = [[i for i in everyone if i != seized - 1] for seized in range(first, last + 1)]
    if bounds(config.onset_s)[1] > 0:
        teams.append(everyone)
    largest = max(np.linalg.eigvalsh(coupling[np.ix_(list(team), list(team))])[-1] for team in teams)
    return float(2.0 / (gain * largest))


def coupling_matrix(num_vehicles: int) -> FloatArray:
    """K (n, n) in e_front + e_rear = -K x + constants: each vehicle between its neighbours, the rear one has one."""
    matrix = 2.0 * np.eye(num_vehicles) - np.eye(num_vehicles, k=1) - np.eye(num_vehicles, k=-1)
    matrix[0, 0] = 1.0
    return matrix
