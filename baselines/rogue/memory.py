"""What a policy remembers from decision to decision, episode by episode."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policy import State
from cps_envs.core.types import BoolArray, FloatArray


def recalled(first: FloatArray, state: State, episode_start: BoolArray | None) -> FloatArray:
    """The remembered array (B,), with `first` (B,) in the episodes whose episode starts."""
    if state is None:
        return first
    return state[0] if episode_start is None else np.where(episode_start, first, state[0])
