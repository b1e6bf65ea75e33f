"""The building and its controller: heating by the gains of (4.18), and one step of (4.5)."""

from __future__ import annotations

import numpy as np

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray
from cps_envs.hvac.model import Model
from cps_envs.hvac.state import State
from cps_envs.hvac.vectors import copy, drift


@inlined
def heat(model: Model, episode: State, estimate: FloatArray, change: FloatArray) -> None:
    """Set the heating of this step from xh(k) and dxh(k), both (n,) C.

    The integrator u_c is continuous and clamped to [0, E]; only what is applied is rounded to a level (4.18).
    """
    ahead = model.feedforward[episode.step[0]]
    for i in range(len(ahead)):
        du = -ahead[i]
        for j in range(len(ahead)):
            du += model.error_gain[i, j] * (model.reference_c - estimate[j])
            du -= model.difference_gain[i, j] * change[j]
        episode.integrator[i] = min(max(episode.integrator[i] + du, 0.0), model.max_heating_w)
        episode.heating[i] = min(model.level_w * np.rint(episode.integrator[i] / model.level_w), model.max_heating_w)


@inlined
def move(model: Model, episode: State) -> None:
    """Go from k to k + 1: the plant (4.5) with what the model does not know, and the forced response."""
    w = model.weather[episode.step[0]]
    supplied = np.empty(len(w))
    for i in range(len(w)):
        supplied[i] = episode.heating[i] + episode.heat[i]
        episode.energy_j[0] += episode.heating[i] * model.step_s
    copy(drift(episode.plant, model.B, model.G, episode.temperature, supplied, w), episode.temperature)
    copy(drift(model.A, model.B, model.G, episode.forced, episode.heating, w), episode.forced)
    episode.step[0] += 1
