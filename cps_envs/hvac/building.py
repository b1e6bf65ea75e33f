"""The building as a network of heat capacities and resistances, and the weather around it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.declare.config import extremes, over_time, series_in
from cps_envs.core.declare.places import Places, place_episodes
from cps_envs.core.types import FloatArray
from cps_envs.hvac.parameters import DAY_S, Parameters

AHEAD_H = (0.0, 2.0, 4.0, 6.0)  # at which the defender sees the outside temperature


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


def outdoor(config: Parameters, times_s: FloatArray) -> FloatArray:
    """Outside temperature (T,), C, at times (T,) from midnight on: `outdoor_c`, or a mean and a sine of 24 h."""
    if config.outdoor_c != ():
        return over_time(config, "outdoor_c", times_s, 1)[:, 0]
    temperature_c: FloatArray = config.outdoor_mean_c + config.outdoor_swing_c * np.sin(2.0 * np.pi * times_s / DAY_S)
    return temperature_c


def outdoor_range(config: Parameters) -> tuple[float, float]:
    """The least and the greatest outside temperature, C, at least 1 C on both sides of their middle."""
    if config.outdoor_c == ():
        swing = max(config.outdoor_swing_c, 1.0)
        return config.outdoor_mean_c - swing, config.outdoor_mean_c + swing
    low, high = extremes(config.outdoor_c)
    middle = 0.5 * (low + high)
    return min(low, middle - 1.0), max(high, middle + 1.0)


def weather(config: Parameters, times_s: FloatArray) -> FloatArray:
    """The temperature w (T, n), C, behind each zone's wall: ground or outside.

    Internal heat q of a zone with the wall resistance R is there as R q: B q = G R q in (4.5).
    """
    w = np.repeat(outdoor(config, times_s)[:, np.newaxis], config.num_zones, axis=1)
    ground = np.array(config.ground_zones, int) - 1
    w[:, ground] = over_time(config, "ground_c", times_s, len(ground))
    if config.internal_heat_w != 0.0:
        heat_w = over_time(config, "internal_heat_w", times_s, config.num_zones)
        w += heat_w * np.array(config.wall_resistance_k_per_w)
    return w


def places_of(config: Parameters) -> Places:
    """Where in the series episodes begin: at midnights.

    Raises:
        ConfigurationError: the series are too short.
    """
    ahead_s = max(config.prediction_steps * config.step_s, 3600.0 * AHEAD_H[-1])
    return place_episodes(
        list(series_in(config).values()),
        step_s=config.step_s,
        steps=config.num_steps + round(ahead_s / config.step_s),
        every_s=DAY_S,
        split=config.series_split,
        block_s=config.series_block_s,
    )
