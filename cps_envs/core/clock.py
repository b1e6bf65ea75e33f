"""The clocks of a batch. They are compiled: on small arrays each NumPy operation takes longer than a whole call."""

from __future__ import annotations

from cps_envs.core.kernels import kernel
from cps_envs.core.types import BoolArray, IntArray


@kernel
def tick(elapsed: IntArray, envs: BoolArray, num_steps: int) -> None:
    """Add game steps to what has elapsed (B,) in the marked environments (B,)."""
    for b in range(len(elapsed)):
        if envs[b]:
            elapsed[b] += num_steps


@kernel
def mark_due(elapsed: IntArray, envs: BoolArray, interval: int, due: BoolArray) -> int:
    """Fill `due` (B,): marked environments with a decision due, one every `interval` steps. Returns how many."""
    count = 0
    for b in range(len(elapsed)):
        due[b] = envs[b] and elapsed[b] % interval == 0
        count += due[b]
    return count
