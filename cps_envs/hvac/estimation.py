"""Estimates of the zone temperatures by every choice of the defender, and the residuals of the sets, each step."""

from __future__ import annotations

from cps_envs.core.compute.kernels import copy, fill, inlined
from cps_envs.core.types import FloatArray
from cps_envs.hvac.dynamics import drift
from cps_envs.hvac.filtering import update_filters
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.state import Scratch, State
from cps_envs.hvac.window import sum_windows


@inlined
def is_ready(rules: Rules, episode: State) -> bool:
    """Whether the window of N_e samples is full."""
    return bool(episode.step[0] >= rules.window_steps)


@inlined
def estimate(model: Model, rules: Rules, episode: State, scratch: Scratch) -> None:
    """Renew estimates and residuals from the readings of k; the window holds those of k - N_e .. k - 1."""
    k, by_model = episode.step[0], len(episode.residual) + 1
    copy(episode.estimate.reshape(-1), episode.previous.reshape(-1))
    average_readings(model, episode.reading, episode.estimate[0])
    last = len(episode.estimate) - rules.thermostats
    if rules.thermostats:
        copy(episode.estimate[0], episode.estimate[last])
    for s in range(len(episode.measured)):
        episode.series[k, s] = episode.reading[s] - episode.forced[model.zone[s]]
    update_filters(model, rules, episode, scratch)
    if is_ready(rules, episode):
        sum_windows(model, episode, k - rules.window_steps, scratch.sums)
        samples = k - rules.window_steps + 1
        for a in range(len(episode.residual)):
            estimate_set(model, episode, a, scratch)
            episode.residual_sum[a] += episode.residual[a]
            episode.mean_residual[a] = episode.residual_sum[a] / samples
        w = model.weather[episode.first[0] + k - 1]
        drift(model.A, model, episode.fed, episode.heating, w, episode.estimate[by_model])
        for f in range(len(episode.filtered)):
            copy(episode.filtered[f, : len(episode.forced)], episode.estimate[by_model + 1 + f])
        return
    for choice in range(1, last):
        for i in range(len(episode.forced)):
            started = episode.forced[i] + episode.recursive[i] if k > 0 else episode.estimate[0, i]
            episode.estimate[choice, i] = started
    update_recursive(model, episode, scratch)


@inlined
def average_readings(model: Model, reading: FloatArray, out: FloatArray) -> None:
    """The mean reading of each zone, (n,)."""
    n = len(out)
    fill(out, 0.0)
    for s in range(len(reading)):
        out[model.zone[s]] += reading[s]
    for i in range(n):
        out[i] /= len(reading) // n


@inlined
def estimate_set(model: Model, episode: State, a: int, scratch: Scratch) -> None:
    """xh_a = F + A^N_e pinv(O_a) r, and J_a = mean over the set of (y_s - xh_a at its zone)^2, (4.32)."""
    found = episode.estimate[a + 1]
    copy(episode.forced, found)
    if model.window_begin[a] < 0:
        add_sums(model, a, scratch, found)
    else:
        add_window(model, episode, a, found)
    square, size = 0.0, 0
    for s in range(len(episode.measured)):
        if model.member[a, s]:
            square += (episode.reading[s] - found[model.zone[s]]) ** 2
            size += 1
    episode.residual[a] = square / size


@inlined
def add_sums(model: Model, a: int, scratch: Scratch, found: FloatArray) -> None:
    """Add A^N_e (O_a' O_a)^-1 sum of h_s to an estimate (n,)."""
    total, n = scratch.vector, len(found)
    fill(total, 0.0)
    for s in range(model.member.shape[1]):
        if model.member[a, s]:
            for i in range(n):
                total[i] += scratch.sums[s * n + i]
    for j in range(n):
        for i in range(n):
            found[i] += model.set_gain[a, j, i] * total[j]


@inlined
def add_window(model: Model, episode: State, a: int, found: FloatArray) -> None:
    """Add A^N_e pinv(O_a) r to an estimate (n,), r being the residual readings of the window one by one."""
    row, window = model.window_begin[a], len(model.decay) - 1
    for t in range(episode.step[0] - window, episode.step[0]):
        for s in range(len(episode.measured)):
            if model.member[a, s]:
                for i in range(len(found)):
                    found[i] += model.window_gain[row, i] * episode.series[t, s]
                row += 1


@inlined
def update_recursive(model: Model, episode: State, scratch: Scratch) -> None:
    """Recursive least squares on the residual readings of all sensors, then one step ahead."""
    z, P, n = episode.recursive, episode.covariance, len(episode.recursive)
    gain, row = scratch.vector, scratch.change
    for s in range(len(episode.measured)):
        i = model.zone[s]
        innovation = episode.series[episode.step[0], s] - z[i]
        for p in range(n):
            gain[p] = P[p, i] / (P[i, i] + 1.0)
            row[p] = P[i, p]
        for p in range(n):
            z[p] += gain[p] * innovation
            for q in range(n):
                P[p, q] -= gain[p] * row[q]
    move_ahead(model.A, z, P, scratch)


@inlined
def move_ahead(A: FloatArray, z: FloatArray, P: FloatArray, scratch: Scratch) -> None:
    """A z and A P A' in the place of z (n,) and P (n, n)."""
    n, vector, matrix = len(z), scratch.vector, scratch.matrix
    for i in range(n):
        vector[i] = 0.0
        for m in range(n):
            vector[i] += A[i, m] * z[m]
    copy(vector, z)
    for i in range(n):
        fill(matrix[i], 0.0)
        for m in range(n):
            for j in range(n):
                matrix[i, j] += A[i, m] * P[m, j]
    for i in range(n):
        for j in range(n):
            P[i, j] = 0.0
            for m in range(n):
                P[i, j] += matrix[i, m] * A[j, m]


@inlined
def choose(model: Model, rules: Rules, episode: State, choice: int, change: FloatArray) -> None:
    """Feed xh(k) of a choice to the controller, and fill `change` (n,) C with dxh(k).

    A choice that needs the full window before it is full means the model; thermostats do not. A change is that of the
    chosen estimate itself, whether it was chosen before or not. The model, and all that come up first at k = N_e, are
    compared with what the controller got before.
    """
    k, by_model = episode.step[0], len(episode.residual) + 1
    choice = min(max(choice, 0), len(episode.estimate) - 1)
    raw = choice == 0 or (rules.thermostats and choice == len(episode.estimate) - 1)
    if not raw and not is_ready(rules, episode):
        choice = by_model
    first = choice == by_model or (not raw and k == rules.window_steps)
    for i in range(len(change)):
        before = episode.fed[i] if first else episode.previous[choice, i]
        found = episode.estimate[choice, i]
        change[i] = found - before if k > 0 else 0.0
        episode.fed[i] = found
    episode.choice[0] = choice
