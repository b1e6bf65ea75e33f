"""Section 2 of the specification as a plain loop over vehicles, written from its text and not from the kernels."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, inf, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Row = NDArray[np.float64]


def limit(value: float, low: float, high: float) -> float:
    return max(low, min(high, value))


@dataclass
class Reference:
    """One string of vehicles, front to rear; `p` has the names of PARAMETERS, `t_d` one time per platoon."""

    p: SimpleNamespace
    x: Row
    v: Row
    t_d: Row
    delay: Row
    driver_headway: Row
    step: int = 0
    totals: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.x)
        self.a, self.u, self.error = np.zeros(count), np.zeros(count), np.zeros(count)
        self.previous_gap = np.full(count, inf)
        self.rear: set[int] = set()
        self.involved: dict[int, bool] = {}  # vehicle: was its platoon intact then
        self.stops, self.armed = np.zeros(count, int), np.ones(count, bool)
        self.intact_error, self.first_collision = 0.0, -1.0

    def gap(self, q: int) -> float:
        return float(self.x[q - 1] - self.x[q])

    def intact(self, q: int) -> bool:
        return self.step * self.p.dt_s < self.t_d[q // self.p.vehicles_per_platoon] - 1e-9

    def mitigable(self, q: int) -> bool:
        return self.intact(q) and any(not self.intact(front) for front in range(q))

    def human(self, q: int) -> bool:
        return self.step * self.p.dt_s >= self.t_d[q // self.p.vehicles_per_platoon] + self.delay[q] - 1e-9

    def idm(self, q: int) -> float:
        p, v = self.p, float(self.v[q])
        free = 1.0 - (v / p.desired_speed_mps) ** 4
        if q == 0:
            return p.max_acceleration_mps2 * free
        if self.gap(q) <= 0:
            return p.min_acceleration_mps2
        root = sqrt(abs(p.min_acceleration_mps2) * p.max_acceleration_mps2)
        wanted = v * self.driver_headway[q] + v * (v - self.v[q - 1]) / (2 * root)
        return p.max_acceleration_mps2 * (free - ((p.standstill_gap_m + max(0.0, wanted)) / self.gap(q)) ** 2)

    def law(self, q: int) -> float:
        p, v = self.p, self.v
        place = q % p.vehicles_per_platoon
        if self.human(q):
            return self.idm(q)
        if q == 0:
            return p.derivative_gain * (p.desired_speed_mps - v[0])
        if place == 0:
            excess = self.gap(q) - p.headway_s * v[q]
            if p.transitional_controller and v[q - 1] < v[q] and excess > 0:
                braking = (v[q] - v[q - 1]) ** 2 / (2 * excess)
                if braking >= 2:
                    return -braking
            return p.proportional_gain * excess + p.derivative_gain * (v[q - 1] - v[q])
        ahead, rate = self.gap(q) - p.desired_gap_m, v[q - 1] - v[q]
        if place < p.vehicles_per_platoon - 1:
            ahead -= self.gap(q + 1) - p.desired_gap_m
            rate -= v[q] - v[q + 1]
        return p.proportional_gain * ahead + p.derivative_gain * rate

    def command(self, q: int, correction: float) -> float:
        p, low, high = self.p, self.p.min_acceleration_mps2, self.p.max_acceleration_mps2
        u = self.law(q)
        if self.mitigable(q) and abs(correction) >= 0.05:
            u = limit(u, low, high) + correction
        if p.saturate_command:
            u = limit(u, low, high)
        if q > 0:
            squares = self.v[q] ** 2 - self.v[q - 1] ** 2
            if p.one_sided_avoidance:
                squares = max(0.0, squares)
            if self.gap(q) <= p.standstill_gap_m + squares / (2 * abs(low)):
                u = low
        return float(u)

    def move(self, q: int) -> tuple[float, float, float]:
        p, x, v, a, u = self.p, self.x[q], self.v[q], self.a[q], self.u[q]
        dt, tau = p.dt_s, p.tau_s
        if p.exact_integration:
            e, lag = exp(-dt / tau), a - u
            new = x + v * dt + u * dt**2 / 2 + lag * tau * (dt - tau * (1 - e))
            x, v, a = (
                (new if v + u * dt + lag * tau * (1 - e) > p.min_speed_mps else max(new, x)),
                (v + u * dt + lag * tau * (1 - e)),
                u + lag * e,
            )
        else:
            x, v, a = (
                x + dt * v,
                v + dt * a,
                limit(a + dt * (u - a) / tau, p.min_acceleration_mps2, p.max_acceleration_mps2),
            )
        if v >= p.max_speed_mps:
            v, a = p.max_speed_mps, min(a, 0.0)
        if v <= p.min_speed_mps:
            v, a = p.min_speed_mps, max(a, 0.0)
        return x, v, a

    def advance(self, steps: int, correction: Row) -> Reference:
        count = len(self.x)
        for _ in range(steps):
            self.u = np.array([self.command(q, correction[q]) for q in range(count)])
            self.previous_gap[1:] = [self.gap(q) for q in range(1, count)]
            moved = [self.move(q) for q in range(count)]
            self.x, self.v, self.a = (np.array(column) for column in zip(*moved, strict=True))
            self.collide()
            self.count_errors()
            self.step += 1
        return self

    def collide(self) -> None:
        touching = [q for q in range(1, len(self.x)) if self.gap(q) <= 0]
        for q in touching:
            if q not in self.rear:
                self.rear.add(q)
                for vehicle in (q, q - 1):
                    self.involved.setdefault(vehicle, self.intact(vehicle))
                if self.first_collision < 0:
                    self.first_collision = (self.step + 1) * self.p.dt_s
        if self.p.inelastic_contact:
            for q in range(1, len(self.x)):
                if self.gap(q) <= 0:
                    self.x[q] = self.x[q - 1]
                    if self.v[q] > self.v[q - 1]:
                        self.v[q], self.a[q] = self.v[q - 1], min(self.a[q], self.a[q - 1])

    def count_errors(self) -> None:
        errors = np.abs(self.v - self.p.desired_speed_mps)
        self.error += errors
        intact = [errors[q] for q in range(len(errors)) if self.intact(q)]
        self.intact_error += float(np.mean(intact)) if intact else 0.0
        for q, speed in enumerate(self.v):
            if speed < 0.01 and self.armed[q]:
                self.stops[q] += 1
                self.armed[q] = False
            if speed > 1.0:
                self.armed[q] = True
