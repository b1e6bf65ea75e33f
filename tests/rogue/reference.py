"""Sections 2, 4 and 5 of the specification as a plain loop over vehicles, written from its text, not from the kernels.

Vehicles are numbered 1 (rear) to n (leader) as in the text; arrays have an unused entry 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from cps_envs.rogue.config import RogueConfig


def clip(value: float, low: float, high: float) -> float:
    return max(low, min(high, value))


@dataclass
class Reference:
    """One platoon; `laws` and `modified` by vehicle number, `command` in m/s2 where the law is "command"."""

    c: RogueConfig
    x: NDArray[np.float64]
    v: NDArray[np.float64]
    laws: dict[int, str]
    modified: dict[int, bool]
    command: dict[int, float]
    ratio: float = 1.0
    onset_s: float = 0.0

    def __post_init__(self) -> None:
        n = self.c.num_vehicles
        self.x, self.v = np.concatenate([[-inf], self.x]), np.concatenate([[0.0], self.v])
        self.a, self.z, self.mode = np.zeros(n + 1), np.zeros((n + 1, 2)), [""] * (n + 1)
        self.s = np.full(n + 1, self.c.separation_m)
        self.start, self.k, self.damage, self.armed = self.x[n], 0, np.zeros(n), [True] * n

    @property
    def seats(self) -> tuple[int, ...]:
        return self.c.attacker_indices or (self.c.attacker_index,)  # type: ignore[return-value]

    def sliding(self, e: float, d: float, a_m: float) -> float:
        c = self.c
        gain = 2 * c.surface_slope_per_s * c.max_speed_mps + a_m + c.boundary_layer_mps
        return clip((c.surface_slope_per_s * e + d) / c.boundary_layer_mps, -1, 1) * gain

    def front(self, i: int, q: float) -> tuple[float, float]:
        if i == self.c.num_vehicles:
            return self.start + self.c.reference_speed_mps * self.k * self.c.dt_s - self.x[i], (
                self.c.reference_speed_mps - self.v[i]
            )
        return self.x[i + 1] - self.x[i] - q, self.v[i + 1] - self.v[i]

    def rear(self, i: int, q: float) -> tuple[float, float]:
        return (0.0, 0.0) if i == 1 else (self.x[i - 1] - self.x[i] + q, self.v[i - 1] - self.v[i])

    def combined(self, i: int) -> tuple[float, float]:
        (e_f, d_f), (e_r, d_r) = self.front(i, self.c.separation_m), self.rear(i, self.c.separation_m)
        return e_f + e_r, d_f + d_r

    def detect(self, i: int) -> None:
        c = self.c
        for side, j in ((0, i + 1), (1, i - 1)):
            if not 1 <= j <= c.num_vehicles:
                continue
            e, d = (self.front if side == 0 else self.rear)(i, c.separation_m)
            low = c.drive_mps2 * c.min_effort - c.drag_per_s * self.v[j] if self.v[j] > 0 else 0.0
            high = c.drive_mps2 * c.max_effort - c.drag_per_s * self.v[j]
            expected = clip(self.sliding(-e, -d, c.max_acceleration_mps2), low, high)
            r = self.a[j] - expected
            self.z[i, side] += c.dt_s * (-2 * pi * c.detector_cutoff_hz * self.z[i, side] + r**2)
        if not self.mode[i] and max(self.z[i]) > c.alarm_threshold:
            self.mode[i] = "front" if self.z[i, 0] >= self.z[i, 1] else "rear"

    def follow(self, i: int, side: str) -> float:
        c = self.c
        e, d = (self.front if side == "front" else self.rear)(i, self.s[i])
        if not self.modified[i] or (side, i) in (("front", c.num_vehicles), ("rear", 1)):
            return self.sliding(e, d, c.max_acceleration_mps2)
        rho, sigma, a_m = sqrt(e**2 + d**2), c.separation_m, c.max_acceleration_mps2
        for share in (c.outer_share, c.middle_share, c.inner_share):
            if rho < share * sigma:
                a_m = share * c.max_acceleration_mps2
        if self.k % round(c.growth_interval_s / c.dt_s) == 0 and abs(e) < c.inner_share * sigma:
            self.s[i] = min(self.s[i] + c.growth_step_m, sigma + c.max_growth_m)
        return self.sliding(e, d, a_m)

    def human(self, i: int) -> float:
        c, a, b = self.c, self.c.driver_acceleration_mps2, self.c.driver_braking_mps2
        free = 1 - (self.v[i] / c.reference_speed_mps) ** 4
        if i == c.num_vehicles:
            e, d = self.front(i, 0.0)
            return clip(0.1 * e + 1.0 * d, -3, 2) if c.human_returns else a * free
        gap = max(self.x[i + 1] - self.x[i] - c.vehicle_length_m, 0.1)
        approach = (self.v[i] - self.v[i + 1]) / (2 * sqrt(a * b))
        return a * (free - (max(0.0, c.driver_gap_m + self.v[i] * (c.driver_headway_s + approach)) / gap) ** 2)

    def desired(self, i: int) -> float:
        c = self.c
        self.detect(i)
        law = self.laws[i]
        if law == "detecting":
            law = self.mode[i] or "sliding"
        if law == "linear":
            e, d = self.combined(i)
            return c.proportional_gain * e + c.derivative_gain * d
        if law == "sliding":
            return self.sliding(*self.combined(i), c.max_acceleration_mps2)
        if law in ("front", "rear"):
            return self.follow(i, law)
        return self.human(i) if law == "human" else self.command[i]

    def step(self, *efforts: float) -> None:
        """One integration step under the efforts of the seized vehicles, from the rear."""
        c, n = self.c, self.c.num_vehicles
        alpha = {i: c.drive_mps2 * (self.ratio if i in self.seats else 1.0) for i in range(1, n + 1)}
        force = dict(zip(self.seats, efforts, strict=True))
        wanted = {i: self.desired(i) for i in range(1, n + 1) if i not in self.seats}
        if self.k * c.dt_s < self.onset_s - 1e-9:
            wanted |= {m: self.sliding(*self.combined(m), c.max_acceleration_mps2) for m in self.seats}
        for i, u in wanted.items():
            force[i] = clip((u + c.drag_per_s * self.v[i]) / alpha[i], c.min_effort, c.max_effort)
        for i in range(1, n + 1):
            if self.v[i] <= 0 and force[i] < 0:
                force[i] = 0.0
            self.a[i] = alpha[i] * force[i] - c.drag_per_s * self.v[i]
            self.v[i] = max(0.0, self.v[i] + c.dt_s * self.a[i])
            self.x[i] += c.dt_s * self.v[i]
        for i in range(1, n):
            (self.bump if c.contact == "solid" else self.overlap)(i)
        self.k += 1

    def overlap(self, i: int) -> None:
        if self.x[i + 1] - self.x[i] < self.c.vehicle_length_m:
            self.damage[i] += abs(self.v[i + 1] - self.v[i]) * self.c.dt_s

    def bump(self, i: int) -> None:
        gap = self.x[i + 1] - self.x[i]
        if gap > self.c.vehicle_length_m + 0.05:
            self.armed[i] = True
        if gap >= self.c.vehicle_length_m:
            return
        closing = self.v[i] - self.v[i + 1]
        if closing > 0:
            self.damage[i] += closing if self.armed[i] else 0.0
            self.v[i] = self.v[i + 1] = (self.v[i] + self.v[i + 1]) / 2
        self.x[i] -= (self.c.vehicle_length_m - gap) / 2
        self.x[i + 1] += (self.c.vehicle_length_m - gap) / 2
        self.armed[i] = False
