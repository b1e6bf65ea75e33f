"""How kernels of policies read observations, and what a policy remembers from decision to decision."""

from __future__ import annotations

import numpy as np

from cps_envs.core.kernels import Record, inlined
from cps_envs.core.policy import State
from cps_envs.core.seen import Seen
from cps_envs.core.types import FloatArray, Observation


@inlined
def read(observation: Observation, scale: FloatArray, b: int, entry: int) -> float:
    """An entry of environment `b` in its unit, as `Fields.decode` gives it."""
    return float(observation[b, entry] * scale[1, entry] + scale[0, entry])


@inlined
def vehicles(values: FloatArray, at: Record, longest: int) -> int:
    """How many vehicles an episode has, whose decoded observation is `values`; `longest` in the configuration."""
    absent = at.time_left_s - at.present
    for k in range(at.present, at.time_left_s):
        absent -= int(values[k] > 0.5)
    return int(longest - absent)


def recalled(first: FloatArray, seen: Seen, state: State) -> FloatArray:
    """A fresh copy of the remembered array (B,), with `first` (B,) in the environments whose episode starts."""
    return first if state is None else np.where(seen.start, first, state[0])
