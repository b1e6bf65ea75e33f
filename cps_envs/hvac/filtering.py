"""One step of the Kalman filters that the defender can choose from: predictions, innovations, corrections."""

from __future__ import annotations

from cps_envs.core.compute.kernels import copy, fill, inlined
from cps_envs.hvac.dynamics import drift
from cps_envs.hvac.model import Model, Rules
from cps_envs.hvac.state import Scratch, State


@inlined
def start_filters(rules: Rules, episode: State) -> None:
    """Every filter knows the initial temperature and expects no heat."""
    n = len(episode.temperature)
    for f in range(len(episode.filtered)):
        fill(episode.filtered[f, :n], rules.initial_c)
        fill(episode.filtered[f, n:], 0.0)
    fill(episode.innovation.reshape(-1), 0.0)
    fill(episode.innovation_mean.reshape(-1), 0.0)


@inlined
def update_filters(model: Model, rules: Rules, episode: State, scratch: Scratch) -> None:
    """Predict the readings of k from the heating of k - 1, and correct by the sensors that each filter uses."""
    n, k = len(episode.temperature), episode.step[0]
    for f in range(len(episode.filtered)):
        x, d = episode.filtered[f, :n], episode.filtered[f, n:]
        if k > 0:
            for i in range(n):
                scratch.change[i] = episode.heating[i] + d[i]
                d[i] *= rules.filter_memory
            drift(model.A, model, x, scratch.change, model.weather[episode.first[0] + k - 1], scratch.vector)
            copy(scratch.vector, x)
        copy(x, scratch.vector)
        for s in range(len(episode.measured)):
            difference = episode.reading[s] - scratch.vector[model.zone[s]]
            for i in range(2 * n):
                episode.filtered[f, i] += model.filter_gain[f, i, s] * difference
            scaled = difference * model.filter_scale[f, s]
            episode.innovation[f, s] = scaled
            episode.innovation_mean[f, s] += rules.innovation_share * (scaled - episode.innovation_mean[f, s])
