"""Reading and writing the part of a policy's state that belongs to some lanes of a batch."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policy import State
from cps_envs.core.types import BoolArray


def take(state: State, lanes: BoolArray) -> State:
    """The state of the marked lanes."""
    return None if state is None else tuple(array[lanes] for array in state)


def put(state: State, lanes: BoolArray, part: State) -> State:
    """`state` with the marked lanes replaced by `part`; lanes not yet seen are filled with zeros."""
    if part is None:
        return state
    if state is None:
        state = tuple(np.zeros((len(lanes), *array.shape[1:]), array.dtype) for array in part)
    for whole, piece in zip(state, part, strict=True):
        whole[lanes] = piece
    return state
