"""Model predictive control with integral action as constant gains, (4.6) to (4.18) and appendix C."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.types import FloatArray
from cps_envs.hvac.building import Building


class Prediction(NamedTuple):
    """X = M1 x(k) + M2 dx(k) + M3 dU + M4 dW over N steps of n zones, (4.13)."""

    M1: FloatArray  # (N n, n)
    M2: FloatArray  # (N n, n)
    M3: FloatArray  # (N n, N n)
    M4: FloatArray  # (N n, N n)


class Gains(NamedTuple):
    """du(k) = K_e (x_r - xh(k)) - K_d dxh(k) - K_w dW(k), (4.18) without constraints."""

    K_e: FloatArray  # (n, n) W/C
    K_d: FloatArray  # (n, n) W/C
    K_w: FloatArray  # (n, N n) W/C


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
    return Gains(K_e=L @ M1, K_d=L @ M2, K_w=L @ M4)


def feedforward(K_w: FloatArray, w: FloatArray, steps: int) -> FloatArray:
    """K_w dW(k) of the known weather, (steps, n) W; w (at least steps + N - 1, n) in C, with w(-1) = w(0)."""
    n = w.shape[1]
    horizon = K_w.shape[1] // n
    dw = np.diff(w, axis=0, prepend=w[:1])
    windows = np.lib.stride_tricks.sliding_window_view(dw.reshape(-1), horizon * n)[::n][:steps]
    ahead: FloatArray = windows @ K_w.T
    return ahead
