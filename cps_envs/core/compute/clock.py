"""The clocks of a batch. They are compiled: on small arrays each NumPy operation takes longer than a whole call."""

from __future__ import annotations

from cps_envs.core.compute.kernels import kernel
from cps_envs.core.types import BoolArray, IntArray


@kernel
def tick(elapsed: IntArray, envs: BoolArray, num_steps: int) -> int:
    """Add game steps to what has elapsed (B,) in the marked environments (B,). Returns the most that any has."""
    latest = 0
    for b in range(len(elapsed)):
        if envs[b]:
            elapsed[b] += num_steps
        latest = max(latest, elapsed[b])
    return latest


@kernel
def mark_due(elapsed: IntArray, envs: BoolArray, interval: int, due: BoolArray) -> int:
    """Fill `due` (B,): marked environments with a decision due, one every `interval` steps. Returns how many."""
    count = 0
    for b in range(len(elapsed)):
        due[b] = envs[b] and elapsed[b] % interval == 0
        count += due[b]
    return count


@kernel
def mark_ends(
    ended: BoolArray,
    elapsed: IntArray,
    limits: tuple[int, int],
    envs: BoolArray,
    terminated: BoolArray,
    truncated: BoolArray,
) -> int:
    """Fill `terminated` and `truncated` (B,): marked environments that have ended, or else are cut off by a caller.

    `ended` (B,) are those that physics has ended. `limits` are the game's horizon, at which an episode ends too, and
    the caller's own most steps, at most as many. Returns how many have ended or are cut off.
    """
    horizon, most = limits
    count = 0
    for b in range(len(elapsed)):
        terminated[b] = envs[b] and (ended[b] or elapsed[b] >= horizon)
        truncated[b] = envs[b] and not terminated[b] and elapsed[b] >= most
        count += terminated[b] or truncated[b]
    return count


@kernel
def restart(elapsed: IntArray, terminated: BoolArray, envs: BoolArray) -> None:
    """Set the clocks of the marked environments (B,) to zero; they have not ended."""
    for b in range(len(elapsed)):
        if envs[b]:
            elapsed[b], terminated[b] = 0, False


@kernel
def count_late(elapsed: IntArray, terminated: BoolArray, envs: BoolArray, latest: int) -> int:
    """How many of the marked environments (B,) go on and are beyond the step `latest`."""
    count = 0
    for b in range(len(elapsed)):
        count += envs[b] and not terminated[b] and elapsed[b] > latest
    return count
