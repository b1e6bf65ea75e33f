"""The clocks of the lanes: compiled, because NumPy takes longer for each operation on a few lanes than for a call."""

from __future__ import annotations

from cps_envs.core.compiled import kernel
from cps_envs.core.types import BoolArray, IntArray


@kernel
def tick(elapsed: IntArray, lanes: BoolArray, num_steps: int) -> None:
    """Add game steps to what has elapsed (B,) in the marked lanes (B,)."""
    for b in range(len(elapsed)):
        if lanes[b]:
            elapsed[b] += num_steps


@kernel
def mark_due(elapsed: IntArray, lanes: BoolArray, interval: int, due: BoolArray) -> int:
    """Fill `due` (B,) with the marked lanes in which a decision is due, every `interval` steps; returns how many."""
    count = 0
    for b in range(len(elapsed)):
        due[b] = lanes[b] and elapsed[b] % interval == 0
        count += due[b]
    return count
