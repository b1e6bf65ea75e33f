"""Kalman filters that know of drifting heat, as constant gains: one for each set of sensors.

The state of a filter is the temperature of every zone and the heat that the model does not know, z = (x, d). Its model
is x(k + 1) = A x + B (u + d) + G w and d(k + 1) = phi d + noise, with phi = exp(-dt / tau) and a stationary standard
deviation of d that the configuration names. Textbook equations; the gain is that of the stationary covariance, so it
does not depend on the readings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.declare.config import of_bodies
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.building import Building
from cps_envs.hvac.parameters import Parameters

DOUBLINGS = 20  # the covariance after 2^20 steps
LEAST_STD_C = 1e-3  # of the noise that filters assume: readings without any would need an inverse that does not exist


class Gains(NamedTuple):
    """The matrices of F Kalman filters for n zones and S sensors."""

    gain: FloatArray  # (F, 2n, S) C/C, then W/C; zero for sensors that the filter does not use
    scale: FloatArray  # (F, S) 1/C, one by the standard deviation of an innovation, reading minus prediction


def memory(config: Parameters) -> float:
    """Phi, the share of the heat that a filter expects to find again one step later."""
    return float(np.exp(-config.step_s / (3600.0 * config.filter_memory_h)))


def filter_gains(config: Parameters, building: Building, member: BoolArray, zone: IntArray) -> Gains:
    """The gains of the filters that use the marked sensors, `member` (F, S), which sit in `zone` (S,)."""
    n, filters = config.num_zones, len(member)
    phi, noise = memory(config), np.maximum(of_bodies(config.noise_std_c, len(zone)), LEAST_STD_C) ** 2
    F = np.block([[building.A, np.diag(building.B)], [np.zeros((n, n)), phi * np.eye(n)]])
    Q = np.diag([0.0] * n + [(1.0 - phi**2) * config.filter_heat_w**2] * n)
    C = np.eye(2 * n)[zone]
    gain, scale = np.empty((filters, 2 * n, len(zone))), np.empty((filters, len(zone)))
    for f, used in enumerate(member):
        information = (C.T * used / noise) @ C
        P = predicted_covariance(F, information, Q)
        gain[f] = np.linalg.solve(np.eye(2 * n) + P @ information, P) @ (C.T * used) / noise
        scale[f] = 1.0 / np.sqrt(np.einsum("si,ij,sj->s", C, P, C) + noise)
    return Gains(gain, scale)


def predicted_covariance(F: FloatArray, information: FloatArray, Q: FloatArray) -> FloatArray:
    """P = F (P^-1 + information)^-1 F' + Q, the stationary covariance before a reading, by doubling.

    `information` is C' R^-1 C. Each round of the structure-preserving doubling algorithm (Anderson 1978) goes twice as
    many steps as the one before; F has to be stable or observed.
    """
    one = np.eye(len(F))
    A, G, H = F.T.copy(), information.copy(), Q.copy()
    for _ in range(DOUBLINGS):
        W = np.linalg.inv(one + G @ H)
        A, G, H = A @ W @ A, G + A @ W @ G @ A.T, H + A.T @ H @ W @ A
        G, H = 0.5 * (G + G.T), 0.5 * (H + H.T)
    return H
