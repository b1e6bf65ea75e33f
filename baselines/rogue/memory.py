"""What a policy remembers from decision to decision, episode by episode."""

from __future__ import annotations

import numpy as np

from cps_envs.core.policy import State
from cps_envs.core.seen import Seen
from cps_envs.core.types import FloatArray


def recalled(first: FloatArray, seen: Seen, state: State) -> FloatArray:
    """The remembered array (B,), with `first` (B,) in the environments whose episode starts."""
    return first if state is None else np.where(seen.start, first, state[0])
