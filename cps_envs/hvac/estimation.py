"""Estimates of the zone temperatures by every choice of the defender, and the residuals of the sets, each step."""

from __future__ import annotations

import numpy as np

from cps_envs.core.compiled import inlined
from cps_envs.core.types import FloatArray
from cps_envs.hvac.model import Model
from cps_envs.hvac.state import State
from cps_envs.hvac.vectors import copy, drift, product

UNCERTAIN = 1e4  # initial variance of the recursive least squares, in units of sigma^2


@inlined
def is_ready(model: Model, lane: State) -> bool:
    """Whether the window of N_e samples is full."""
    return bool(lane.step[0] >= len(model.window))


@inlined
def estimate(model: Model, lane: State) -> None:
    """Renew estimates and residuals from the readings of k; the window holds those of k - N_e .. k - 1."""
    k, last = lane.step[0], len(lane.estimate) - 1
    for choice in range(last + 1):
        copy(lane.estimate[choice], lane.previous[choice])
    average_readings(model, lane.reading, lane.estimate[0])
    for s in range(len(model.zone)):
        lane.history[k, s] = lane.reading[s] - lane.forced[model.zone[s]]
    if is_ready(model, lane):
        estimate_sets(model, lane, window_sums(model, lane))
        copy(drift(model.A, model.B, model.G, lane.fed, lane.heating, model.weather[k - 1]), lane.estimate[last])
        return
    for choice in range(1, last + 1):
        for i in range(len(lane.forced)):
            started = lane.forced[i] + lane.recursive[i] if k > 0 else lane.estimate[0, i]
            lane.estimate[choice, i] = started
    update_recursive(model, lane)


@inlined
def average_readings(model: Model, reading: FloatArray, out: FloatArray) -> None:
    """The mean reading of each zone, (n,)."""
    n = len(out)
    out[:] = 0.0
    for s in range(len(reading)):
        out[model.zone[s]] += reading[s]
    for i in range(n):
        out[i] /= len(reading) // n


@inlined
def window_sums(model: Model, lane: State) -> FloatArray:
    """h_s = sum over t of (A^t)' e_zone(s) r_s(k - N_e + t), (S, n), summed anew each step.

    Sliding the sum on would multiply its error by the inverse of A at each step.
    """
    window = model.window
    first = lane.step[0] - len(window)
    sums = np.zeros(window.shape[1:])
    for t in range(window.shape[0]):
        for s in range(window.shape[1]):
            residual = lane.history[first + t, s]
            for i in range(window.shape[2]):
                sums[s, i] += window[t, s, i] * residual
    return sums


@inlined
def estimate_sets(model: Model, lane: State, sums: FloatArray) -> None:
    """xh_a = F + A^N_e (O_a' O_a)^-1 sum of h_s, and J_a = mean over the set of (y_s - xh_a at its zone)^2, (4.32)."""
    sensors, n = sums.shape
    total = np.empty(n)
    for a in range(len(model.member)):
        total[:] = 0.0
        for s in range(sensors):
            if model.member[a, s]:
                for i in range(n):
                    total[i] += sums[s, i]
        found = lane.estimate[a + 1]
        for i in range(n):
            found[i] = lane.forced[i]
            for j in range(n):
                found[i] += model.set_gain[a, i, j] * total[j]
        square, size = 0.0, 0
        for s in range(sensors):
            if model.member[a, s]:
                square += (lane.reading[s] - found[model.zone[s]]) ** 2
                size += 1
        lane.residual[a] = square / size
        lane.residual_sum[a] += lane.residual[a]


@inlined
def update_recursive(model: Model, lane: State) -> None:
    """Recursive least squares on the residual readings of all sensors, then one step ahead."""
    z, P, n = lane.recursive, lane.covariance, len(lane.recursive)
    gain, row = np.empty(n), np.empty(n)
    for s in range(len(model.zone)):
        i = model.zone[s]
        innovation = lane.history[lane.step[0], s] - z[i]
        for p in range(n):
            gain[p] = P[p, i] / (P[i, i] + 1.0)
            row[p] = P[i, p]
        for p in range(n):
            z[p] += gain[p] * innovation
            for q in range(n):
                P[p, q] -= gain[p] * row[q]
    copy(product(model.A, z.reshape(n, 1)).reshape(-1), z)
    copy(product(product(model.A, P), model.A.T).reshape(-1), P.reshape(-1))


@inlined
def choose(model: Model, lane: State, choice: int) -> tuple[FloatArray, FloatArray]:
    """xh(k) and dxh(k), each (n,) C, of a choice; one that needs the full window before it is full means the last.

    A change is that of the chosen estimate itself, whether it was chosen before or not. The last choice, and the sets
    when they come up first at k = N_e, are compared with what the controller got before.
    """
    k, last = lane.step[0], len(lane.estimate) - 1
    if choice != 0 and not is_ready(model, lane):
        choice = last
    first = choice == last or (choice != 0 and k == len(model.window))
    before = lane.fed if first else lane.previous[choice]
    estimate, change = np.empty(len(before)), np.empty(len(before))
    for i in range(len(before)):
        estimate[i] = lane.estimate[choice, i]
        change[i] = estimate[i] - before[i] if k > 0 else 0.0
    copy(estimate, lane.fed)
    lane.choice[0] = choice
    return estimate, change
