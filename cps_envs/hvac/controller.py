"""Model predictive control with integral action as constant gains, (4.6) to (4.18) and appendix C."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_envs.core.types import FloatArray
from cps_envs.hvac.building import Building, discretise
from cps_envs.hvac.parameters import Parameters

CHUNK = 30_000  # rows of a product at a time: a year at once would take gigabytes


class Prediction(NamedTuple):
    """X = M1 x(k) + M2 dx(k) + M3 dU + M4 dW over N steps of n zones, (4.13)."""

    M1: FloatArray  # (N n, n)
    M2: FloatArray  # (N n, n)
    M3: FloatArray  # (N n, N n)
    M4: FloatArray  # (N n, N n)


class Gains(NamedTuple):
    """du(k) = K_e (x_r - xh(k)) - K_d dxh(k) - K_w dW(k), (4.18) without constraints.

    Where set-points change, K_r (x_r(k + 1) - x_r(k), ..., x_r(k + N) - x_r(k)) comes to it, from the same program.
    """

    K_e: FloatArray  # (n, n) W/C
    K_d: FloatArray  # (n, n) W/C
    K_w: FloatArray  # (n, N n) W/C
    K_r: FloatArray  # (n, N n) W/C, of set-points; its blocks sum to K_e


def predict(building: Building, horizon: int) -> Prediction:
    """The matrices of (4.13) over `horizon` steps, from the sums S_j = I + A + ... + A^j."""
    A, B, G = building
    n = len(A)
    sums = [np.eye(n)]
    for _ in range(horizon):
        sums.append(np.eye(n) + A @ sums[-1])
    zero = np.zeros((n, n))
    lower = np.block([[sums[r - c] if c <= r else zero for c in range(horizon)] for r in range(horizon)])
    return Prediction(
        M1=np.tile(np.eye(n), (horizon, 1)),
        M2=np.vstack([total - np.eye(n) for total in sums[1:]]),
        M3=lower * np.tile(B, horizon),
        M4=lower * np.tile(G, horizon),
    )


def gains(building: Building, horizon: int, move_weight: float) -> Gains:
    """The gains that minimise (4.8) with Q = I and R = `move_weight` I: the first rows of H_c^-1 M3' Q, (4.16)."""
    M1, M2, M3, M4 = predict(building, horizon)
    H_c = M3.T @ M3 + move_weight * np.eye(len(M3.T))
    first = np.eye(len(H_c), len(building.A))
    L = np.linalg.solve(H_c, first).T @ M3.T
    return Gains(K_e=L @ M1, K_d=L @ M2, K_w=L @ M4, K_r=L)


@lru_cache(maxsize=8)
def control_of(config: Parameters) -> Gains:
    """The gains of a configuration; the arrays are shared, nobody may write to them."""
    return gains(discretise(config), config.prediction_steps, config.move_weight)


def feedforward(gains: Gains, w: FloatArray, reference: FloatArray, steps: int) -> FloatArray:
    """K_w dW(k) of the known weather less K_r of the set-points to come, (steps, n) W, from step 0 on.

    Both courses are (T, n) in C with T at least steps + N; w(-1) = w(0).
    """
    n = w.shape[1]
    horizon = gains.K_w.shape[1] // n
    dw = np.diff(w, axis=0, prepend=w[:1])
    ahead = _in_windows(dw, horizon, steps, gains.K_w)
    if (reference != reference[0]).any():
        coming = _in_windows(reference[1:], horizon, steps, gains.K_r)
        ahead -= coming - reference[:steps] @ gains.K_r.reshape(n, horizon, n).sum(axis=1).T
    return ahead


def _in_windows(course: FloatArray, horizon: int, steps: int, gain: FloatArray) -> FloatArray:
    """The product of a gain (n, N n) with the N rows of a course (T, n) from each of so many steps on, (steps, n)."""
    n = course.shape[1]
    windows = np.lib.stride_tricks.sliding_window_view(course.reshape(-1), horizon * n)[::n][:steps]
    return np.concatenate([windows[k : k + CHUNK] @ gain.T for k in range(0, steps, CHUNK)])
