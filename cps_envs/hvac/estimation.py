"""Estimates of the zone temperatures by every choice of the defender, and the residuals of the sets, each step."""

from __future__ import annotations

import numpy as np

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.hvac.model import Model
from cps_envs.hvac.state import State
from cps_envs.hvac.vectors import copy, drift, product

UNCERTAIN = 1e4  # initial variance of the recursive least squares, in units of sigma^2


@inlined
def is_ready(model: Model, episode: State) -> bool:
    """Whether the window of N_e samples is full."""
    return bool(episode.step[0] >= len(model.window))


@inlined
def estimate(model: Model, episode: State) -> None:
    """Renew estimates and residuals from the readings of k; the window holds those of k - N_e .. k - 1."""
    k, last = episode.step[0], len(episode.estimate) - 1
    for choice in range(last + 1):
        copy(episode.estimate[choice], episode.previous[choice])
    average_readings(model, episode.reading, episode.estimate[0])
    for s in range(len(model.zone)):
        episode.history[k, s] = episode.reading[s] - episode.forced[model.zone[s]]
    if is_ready(model, episode):
        estimate_sets(model, episode, window_sums(model, episode))
        copy(
            drift(model.A, model.B, model.G, episode.fed, episode.heating, model.weather[k - 1]), episode.estimate[last]
        )
        return
    for choice in range(1, last + 1):
        for i in range(len(episode.forced)):
            started = episode.forced[i] + episode.recursive[i] if k > 0 else episode.estimate[0, i]
            episode.estimate[choice, i] = started
    update_recursive(model, episode)


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
def window_sums(model: Model, episode: State) -> FloatArray:
    """h_s = sum over t of (A^t)' e_zone(s) r_s(k - N_e + t), (S, n), summed anew each step.

    Sliding the sum on would multiply its error by the inverse of A at each step.
    """
    window = model.window
    first = episode.step[0] - len(window)
    sums = np.zeros(window.shape[1:])
    for t in range(window.shape[0]):
        for s in range(window.shape[1]):
            residual = episode.history[first + t, s]
            for i in range(window.shape[2]):
                sums[s, i] += window[t, s, i] * residual
    return sums


@inlined
def estimate_sets(model: Model, episode: State, sums: FloatArray) -> None:
    """xh_a = F + A^N_e (O_a' O_a)^-1 sum of h_s, and J_a = mean over the set of (y_s - xh_a at its zone)^2, (4.32)."""
    sensors, n = sums.shape
    total = np.empty(n)
    for a in range(len(model.member)):
        total[:] = 0.0
        for s in range(sensors):
            if model.member[a, s]:
                for i in range(n):
                    total[i] += sums[s, i]
        found = episode.estimate[a + 1]
        for i in range(n):
            found[i] = episode.forced[i]
            for j in range(n):
                found[i] += model.set_gain[a, i, j] * total[j]
        square, size = 0.0, 0
        for s in range(sensors):
            if model.member[a, s]:
                square += (episode.reading[s] - found[model.zone[s]]) ** 2
                size += 1
        episode.residual[a] = square / size
        episode.residual_sum[a] += episode.residual[a]


@inlined
def update_recursive(model: Model, episode: State) -> None:
    """Recursive least squares on the residual readings of all sensors, then one step ahead."""
    z, P, n = episode.recursive, episode.covariance, len(episode.recursive)
    gain, row = np.empty(n), np.empty(n)
    for s in range(len(model.zone)):
        i = model.zone[s]
        innovation = episode.history[episode.step[0], s] - z[i]
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
def choose(model: Model, episode: State, choice: int) -> tuple[FloatArray, FloatArray]:
    """xh(k) and dxh(k), each (n,) C, of a choice; one that needs the full window before it is full means the last.

    A change is that of the chosen estimate itself, whether it was chosen before or not. The last choice, and the sets
    when they come up first at k = N_e, are compared with what the controller got before.
    """
    k, last = episode.step[0], len(episode.estimate) - 1
    if choice != 0 and not is_ready(model, episode):
        choice = last
    first = choice == last or (choice != 0 and k == len(model.window))
    before = episode.fed if first else episode.previous[choice]
    estimate, change = np.empty(len(before)), np.empty(len(before))
    for i in range(len(before)):
        estimate[i] = episode.estimate[choice, i]
        change[i] = estimate[i] - before[i] if k > 0 else 0.0
    copy(estimate, episode.fed)
    episode.choice[0] = choice
    return estimate, change
