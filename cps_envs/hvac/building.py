"""The building as a network of heat capacities and resistances, and the weather around it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.types import FloatArray
from cps_envs.hvac.parameters import Parameters

DAY_S = 86_400.0


class Building(NamedTuple):
    """x(k+1) = A x(k) + B u(k) + G w(k) of (4.5); B and G are diagonal and given by their diagonals."""

    A: FloatArray  # (n, n)
    B: FloatArray  # (n,) C/W per step
    G: FloatArray  # (n,)


def conductances(config: Parameters) -> FloatArray:
    """A_c (n, n) of (4.4), 1/s.

    A_c[i, i] = -(1/C_i) (1/R_i + sum over neighbours j of 1/R_ij); A_c[i, j] = 1/(C_i R_ij) for linked zones.
    """
    capacity = np.array(config.heat_capacity_j_per_k)
    A_c = np.diag(-1.0 / np.array(config.wall_resistance_k_per_w))
    pairs = np.array(config.link_zones, int).reshape(-1, 2) - 1
    for (i, j), resistance in zip(pairs, config.link_resistance_k_per_w, strict=True):
        A_c[[i, j], [j, i]] += 1.0 / resistance
        A_c[[i, j], [i, j]] -= 1.0 / resistance
    A_c /= capacity[:, np.newaxis]
    return A_c


def discretise(config: Parameters) -> Building:
    """The nominal building by forward difference (4.5): A = I + dt A_c, B = dt/C, G = dt/(C R)."""
    capacity = np.array(config.heat_capacity_j_per_k)
    return Building(
        A=transition(config, np.zeros((config.num_zones, config.num_zones))),
        B=config.step_s / capacity,
        G=config.step_s / (capacity * np.array(config.wall_resistance_k_per_w)),
    )


def transition(config: Parameters, beta: FloatArray) -> FloatArray:
    """A_p = I + dt (A_c + beta .* A_c), (n, n): the plant whose A_c is off by the shares beta, (4.30)."""
    return np.eye(config.num_zones) + rates(config) * (1.0 + beta)


def modes(config: Parameters) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (n,) of the nominal A, all real, and its eigenvectors as the columns of V (n, n).

    With C the heat capacities, C A_c is symmetric. So C^1/2 A C^-1/2 = Q D Q' with an orthogonal Q, and V = C^-1/2 Q.
    """
    root = np.sqrt(np.array(config.heat_capacity_j_per_k))
    eigenvalues, Q = np.linalg.eigh(root[:, np.newaxis] * discretise(config).A / root)
    return eigenvalues, Q / root[:, np.newaxis]


def rates(config: Parameters) -> FloatArray:
    """Dt A_c, (n, n): what A and A_p have beside the identity."""
    return config.step_s * conductances(config)


def outdoor(config: Parameters, steps: int) -> FloatArray:
    """Outside temperature (steps,), C, from midnight on: a mean and a sine of 24 h."""
    time_s = config.step_s * np.arange(steps)
    temperature_c: FloatArray = config.outdoor_mean_c + config.outdoor_swing_c * np.sin(2.0 * np.pi * time_s / DAY_S)
    return temperature_c


def weather(config: Parameters, steps: int) -> FloatArray:
    """The temperature w (steps, n), C, behind each zone's wall: ground or outside."""
    w = np.repeat(outdoor(config, steps)[:, np.newaxis], config.num_zones, axis=1)
    w[:, np.array(config.ground_zones, int) - 1] = config.ground_c
    return w
