"""Section 2 of the specification in plain NumPy for one building, written from its text and not from the kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import pinv

Row = NDArray[np.float64]
CAPACITY = np.array([0.52e6, 0.74e6, 0.35e6, 0.55e6])
WALL = np.array([0.42, 0.10, 0.12, 0.15])
LINKS = {(0, 1): 0.016, (0, 2): 0.012, (1, 3): 0.017, (2, 3): 0.047}
STEP_S, STEPS, HORIZON, REFERENCE = 120.0, 720, 80, 25.0


def matrices() -> tuple[Row, Row, Row, Row]:
    """A_c, A, B, G, all (4, 4)."""
    A_c = np.zeros((4, 4))
    for i in range(4):
        total = 1 / WALL[i]
        for pair, resistance in LINKS.items():
            if i in pair:
                j = pair[0] + pair[1] - i
                A_c[i, j] = 1 / (CAPACITY[i] * resistance)
                total += 1 / resistance
        A_c[i, i] = -total / CAPACITY[i]
    B, G = np.diag(STEP_S / CAPACITY), np.diag(STEP_S / (CAPACITY * WALL))
    return A_c, np.eye(4) + STEP_S * A_c, B, G


def weather() -> Row:
    """The temperatures behind the walls w(k), (STEPS + HORIZON, 4)."""
    outside = 23 + 11 * np.sin(2 * np.pi * np.arange(STEPS + HORIZON) * STEP_S / 86400)
    ground = np.full_like(outside, 23.5)
    return np.stack([ground, ground, outside, outside], axis=1)


def gains() -> tuple[Row, Row, Row]:
    """K_e, K_d, K_w by H_c^-1 M3' with the stacked matrices filled block by block."""
    _, A, B, G = matrices()
    sums = [sum((np.linalg.matrix_power(A, i) for i in range(j + 1)), np.zeros((4, 4))) for j in range(HORIZON + 1)]
    M1 = np.vstack([np.eye(4)] * HORIZON)
    M2 = np.vstack([sums[r] - np.eye(4) for r in range(1, HORIZON + 1)])
    M3, M4 = np.zeros((2, 4 * HORIZON, 4 * HORIZON))
    for r, c in product(range(HORIZON), repeat=2):
        if c <= r:
            M3[4 * r : 4 * r + 4, 4 * c : 4 * c + 4] = sums[r - c] @ B
            M4[4 * r : 4 * r + 4, 4 * c : 4 * c + 4] = sums[r - c] @ G
    L = (np.linalg.inv(M3.T @ M3 + 0.25 * np.eye(4 * HORIZON)) @ M3.T)[:4]
    return L @ M1, L @ M2, L @ M4


@dataclass
class Reference:
    """The closed loop; `sets` are tuples of sensors from 1, `forge` gives the readings (S,) of k."""

    noise: Row  # (STEPS, S), C
    sets: tuple[tuple[int, ...], ...]
    window: int
    A_p: Row | None = None
    heat: Row | None = None
    forge: Callable[[int, Row, Row], Row] = lambda k, own, x: own
    choose: Callable[[int, dict[str, Any]], int] = lambda k, seen: 0
    steps: int = STEPS
    trace: dict[str, list[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        A = matrices()[1]
        powers = [np.linalg.matrix_power(A, t) for t in range(self.window + 1)]
        self.zones = [[(s - 1) % 4 for s in sensors] for sensors in self.sets]
        self.P = [powers[-1] @ pinv(np.vstack([power[zones] for power in powers[:-1]])) for zones in self.zones]

    def estimate(self, k: int, forced: list[Row], readings: list[Row]) -> tuple[Row, Row]:
        """xh_a(k) (sets, 4) and J_a(k) (sets,) by the pseudo-inverse of the window's own equations."""
        found, residual = np.empty((len(self.sets), 4)), np.empty(len(self.sets))
        for a, (sensors, zones) in enumerate(zip(self.sets, self.zones, strict=True)):
            index, times = np.array(sensors) - 1, range(k - self.window, k)
            r = np.concatenate([readings[j][index] - forced[j][zones] for j in times])
            found[a] = forced[k] + self.P[a] @ r
            residual[a] = np.mean((readings[k][index] - found[a, zones]) ** 2)
        return found, residual

    def run(self) -> dict[str, Row]:
        """Play the episode; x, u, J (NaN before the window is full), and what the controller got, by step."""
        _, A, B, G = matrices()
        A_p, heat = A if self.A_p is None else self.A_p, np.zeros(4) if self.heat is None else self.heat
        K_e, K_d, K_w = gains()
        w, dw = weather(), np.diff(weather(), axis=0, prepend=weather()[:1])
        x, u_c, u = np.full(4, 24.0), np.zeros(4), np.zeros(4)
        z, P = np.zeros(4), 1e4 * np.eye(4)
        forced, readings = [np.zeros(4)], []
        old: dict[Any, Row] = {}
        fed = np.zeros(4)
        log: dict[str, list[Row]] = {"x": [], "u": [], "J": [], "fed": []}
        zone = np.arange(self.noise.shape[1]) % 4
        for k in range(self.steps):
            readings.append(self.forge(k, x[zone] + self.noise[k], x))
            raw = readings[k].reshape(-1, 4).mean(axis=0)
            options: dict[Any, Row] = {"raw": raw}
            J = np.full(len(self.sets), np.nan)
            if k >= self.window:
                found, J = self.estimate(k, forced, readings)
                options |= dict(enumerate(found)) | {"model": A @ fed + B @ u + G @ w[k - 1]}
            else:
                options["start"] = forced[k] + z if k else raw
                for s, i in enumerate(zone):
                    g = P[:, i] / (P[i, i] + 1)
                    z, P = z + g * (readings[k][s] - forced[k][i] - z[i]), P - np.outer(g, P[i])
                z, P = A @ z, A @ P @ A.T
            pick = self.choose(k, {"J": J})  # 0 raw, 1.. sets, last the model
            name = (
                "raw" if pick == 0 else "start" if k < self.window else ["raw", *range(len(self.sets)), "model"][pick]
            )
            xh = options[name]
            same = old.get(name) if name not in ("model", "start") else None
            dx = np.zeros(4) if k == 0 else xh - (fed if same is None else same)
            u_c = np.clip(u_c + K_e @ (REFERENCE - xh) - K_d @ dx - K_w @ dw[k : k + HORIZON].ravel(), 0, 1000)
            u = 10 * np.round(u_c / 10)
            for key, value in (("x", x), ("u", u), ("J", J), ("fed", xh)):
                log[key].append(value)
            old, fed = options, xh
            forced.append(A @ forced[k] + B @ u + G @ w[k])
            x = A_p @ x + B @ (u + heat) + G @ w[k]
        return {key: np.array(values) for key, values in log.items()}
