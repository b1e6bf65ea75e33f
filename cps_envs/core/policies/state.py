"""Reading and writing the part of a policy's state that belongs to some environments of a batch."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import IntArray, State


def take(state: State | None, rows: IntArray) -> State | None:
    """The state of some environments (k,)."""
    return None if state is None else tuple([array.take(rows, 0) for array in state])


def put(state: State | None, rows: IntArray, part: State | None, num_envs: int) -> State | None:
    """`state` with some environments (k,) replaced by `part`; environments not yet seen are filled with zeros."""
    if part is None:
        return state
    if state is None:
        state = tuple(np.zeros((num_envs, *array.shape[1:]), array.dtype) for array in part)
    for whole, piece in zip(state, part, strict=True):
        whole[rows] = piece
    return state
