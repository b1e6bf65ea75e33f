"""Reading and writing the part of a policy's state that belongs to some environments of a batch."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policy import State
from cps_envs.core.types import BoolArray


def take(state: State, envs: BoolArray) -> State:
    """The state of the marked environments."""
    return None if state is None else tuple(array[envs] for array in state)


def put(state: State, envs: BoolArray, part: State) -> State:
    """`state` with the marked environments replaced by `part`; environments not yet seen are filled with zeros."""
    if part is None:
        return state
    if state is None:
        state = tuple(np.zeros((len(envs), *array.shape[1:]), array.dtype) for array in part)
    for whole, piece in zip(state, part, strict=True):
        whole[envs] = piece
    return state
