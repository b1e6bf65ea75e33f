"""The state of a batch of buildings, as plain arrays that numba kernels work on in place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cps_envs.core.kernels import inlined
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.model import Model


class State(NamedTuple):
    """B episodes, at state x(k). Of the C = sets + 2 choices, 0 is the raw readings and the last is the model.

    Residuals count from k = N_e on, when the window is full, and are zero before that; so long the estimates of all
    choices but 0 are those of the recursive least squares.
    """

    step: IntArray  # (B,) k
    onset: IntArray  # (B,) t_0
    compromised: BoolArray  # (B, S)
    plant: FloatArray  # (B, n, n) A_p
    heat: FloatArray  # (B, n) W, unmeasured
    noise: FloatArray  # (B, K, S) standard normal, of the whole episode
    temperature: FloatArray  # (B, n) C, x(k)
    forced: FloatArray  # (B, n) C, F(k)
    integrator: FloatArray  # (B, n) W, u_c(k - 1)
    heating: FloatArray  # (B, n) W, u(k - 1)
    measured: FloatArray  # (B, S) C, before forging
    reading: FloatArray  # (B, S) C, after forging
    history: FloatArray  # (B, K, S) C, residual readings r_s(k)
    recursive: FloatArray  # (B, n) C, z of the recursive least squares before the window is full
    covariance: FloatArray  # (B, n, n) its covariance in units of sigma^2
    estimate: FloatArray  # (B, C, n) C, xh(k) of every choice
    previous: FloatArray  # (B, C, n) C, xh(k - 1) of every choice
    fed: FloatArray  # (B, n) C, the estimate that the controller got at k - 1
    residual: FloatArray  # (B, sets) C2, J_a(k)
    residual_sum: FloatArray  # (B, sets) C2, of J_a since N_e
    choice: IntArray  # (B,) at k - 1
    used: BoolArray  # (B, sets) chosen at some time
    squared_error: FloatArray  # (B,) C2, sum of |x - x_r|^2 since the onset
    absolute_error: FloatArray  # (B, n) C, sum of |x - x_r| since k = 0
    energy_j: FloatArray  # (B,) heating since k = 0
    counts: IntArray  # (B, 3) steps with a flawed set, with the model, with no set below the threshold


def allocate(num_envs: int, model: Model) -> State:
    """A state with every array zero; `episode.start` fills the episodes."""
    envs, steps = num_envs, len(model.weather)
    sets, sensors = model.member.shape
    n = len(model.B)

    def zeros(*shape: int) -> FloatArray:
        return np.zeros((envs, *shape))

    return State(
        step=np.zeros(envs, np.int64),
        onset=np.zeros(envs, np.int64),
        compromised=np.zeros((envs, sensors), np.bool_),
        plant=zeros(n, n),
        heat=zeros(n),
        noise=zeros(steps, sensors),
        temperature=zeros(n),
        forced=zeros(n),
        integrator=zeros(n),
        heating=zeros(n),
        measured=zeros(sensors),
        reading=zeros(sensors),
        history=zeros(steps, sensors),
        recursive=zeros(n),
        covariance=zeros(n, n),
        estimate=zeros(sets + 2, n),
        previous=zeros(sets + 2, n),
        fed=zeros(n),
        residual=zeros(sets),
        residual_sum=zeros(sets),
        choice=np.zeros(envs, np.int64),
        used=np.zeros((envs, sets), np.bool_),
        squared_error=zeros(),
        absolute_error=zeros(n),
        energy_j=zeros(),
        counts=np.zeros((envs, 3), np.int64),
    )


@inlined
def episode_of(state: State, b: int) -> State:
    """Views of episode `b`: the same fields without the episode axis, per-episode scalars as arrays of length one."""
    return State(
        state.step[b : b + 1],
        state.onset[b : b + 1],
        state.compromised[b],
        state.plant[b],
        state.heat[b],
        state.noise[b],
        state.temperature[b],
        state.forced[b],
        state.integrator[b],
        state.heating[b],
        state.measured[b],
        state.reading[b],
        state.history[b],
        state.recursive[b],
        state.covariance[b],
        state.estimate[b],
        state.previous[b],
        state.fed[b],
        state.residual[b],
        state.residual_sum[b],
        state.choice[b : b + 1],
        state.used[b],
        state.squared_error[b : b + 1],
        state.absolute_error[b],
        state.energy_j[b : b + 1],
        state.counts[b],
    )
