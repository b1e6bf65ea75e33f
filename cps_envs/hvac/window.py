"""Sums over the window of N_e samples that the observers of all sets share, at a cost that does not grow with N_e.

The sums are h_s = sum over t = 0..N_e - 1 of (A^t)' e_zone(s) r_s(first + t), see `moving_horizon`. With A = V D V^-1,
D diagonal, they are V^-T times the sums of D^t v_s r_s, v_s being row zone(s) of V: one number for each mode.

Time is cut into blocks of N_e samples. A window is the tail of one block and the head of the next. Tails are summed
backwards from the block's end, heads forwards from its begin, so that no sum is ever divided by an eigenvalue, which
would let rounding errors grow. Of the tails every `CHUNK`-th is kept as a mark, and those of the present chunk.
"""

from __future__ import annotations

from cps_envs.core.compute.kernels import copy, fill, inlined
from cps_envs.core.types import FloatArray
from cps_envs.hvac.model import CHUNK, Model
from cps_envs.hvac.state import State


@inlined
def sum_windows(model: Model, episode: State, first: int, sums: FloatArray) -> None:
    """The sums (S n,) by modes of the window that begins at sample `first`, one after that of the last call."""
    window = len(model.decay) - 1
    begun = first % window  # samples of the block that the window has left behind
    if begun == 0:
        fill(episode.head, 0.0)
        mark_tails(model, episode, first)
    else:
        add_behind(model, episode.series[first + window - 1], model.decay[begun - 1], episode.head)
    if begun % CHUNK == 0:
        keep_tails(model, episode, first, begun // CHUNK, min(CHUNK, window - begun))
    tail, shrunk = episode.tail[begun % CHUNK], model.decay[window - begun]
    for i in range(sums.size):
        sums[i] = tail[i] + shrunk[i] * episode.head[i]


@inlined
def mark_tails(model: Model, episode: State, first: int) -> None:
    """Sum the block that begins at sample `first` backwards, and keep the sums from each chunk's begin on."""
    total, window = episode.tail[0], len(model.decay) - 1
    fill(total, 0.0)
    fill(episode.mark[len(episode.mark) - 1], 0.0)
    for t in range(window - 1, -1, -1):
        add_before(model, episode.series[first + t], total, total)
        if t % CHUNK == 0:
            copy(total, episode.mark[t // CHUNK])


@inlined
def keep_tails(model: Model, episode: State, first: int, chunk: int, samples: int) -> None:
    """Sum a chunk of so many samples, which begins at sample `first`, backwards, and keep the sums from each on."""
    for t in range(samples - 1, -1, -1):
        after = episode.mark[chunk + 1] if t == samples - 1 else episode.tail[t + 1]
        add_before(model, episode.series[first + t], after, episode.tail[t])


@inlined
def add_before(model: Model, sample: FloatArray, after: FloatArray, target: FloatArray) -> None:
    """Fill `target` (S n,) with the sums of a sample (S,) and of all `after` it (S n,), which may be the same array."""
    n = model.A.shape[1]
    for s in range(sample.size):
        for i in range(s * n, s * n + n):
            target[i] = model.mode[i] * sample[s] + model.decay[1, i] * after[i]


@inlined
def add_behind(model: Model, sample: FloatArray, decayed: FloatArray, target: FloatArray) -> None:
    """Add a sample (S,), with its power of the eigenvalues (S n,), to the sums `target` (S n,)."""
    n = model.A.shape[1]
    for s in range(sample.size):
        for i in range(s * n, s * n + n):
            target[i] += model.mode[i] * decayed[i] * sample[s]
