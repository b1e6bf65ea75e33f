"""The legal levels as masks over the flattened MultiDiscrete action."""

from __future__ import annotations

from cps_envs.core.kernels import borrowed, inlined, kernel
from cps_envs.core.types import Array, IntArray


@kernel
def fill_masks(legal: IntArray, bounds: IntArray, masks: Array) -> None:
    """Fill int8 masks (B, sum(2 bounds + 1)) from the legal levels (B, S, 2); bounds (S,) are the largest levels."""
    for b in range(masks.shape[0]):
        mark(borrowed(legal)[b], bounds, borrowed(masks)[b])


@kernel
def fill_mask(legal: IntArray, b: int, bounds: IntArray, mask: Array) -> None:
    """`fill_masks` of one episode: `mask` is (sum(2 bounds + 1),)."""
    mark(borrowed(legal)[b], bounds, borrowed(mask))


@inlined
def mark(legal: IntArray, bounds: IntArray, mask: Array) -> None:
    """Fill the mask of one episode.

    Where a state leaves a sensor nothing, the mask offers no injection: that move is illegal too, and ends the episode.
    """
    mask[:], start = 0, 0
    for s in range(bounds.size):
        low, high = legal[s]
        if low > high:
            low = high = 0
        mask[start + bounds[s] + low : start + bounds[s] + high + 1] = 1
        start += 2 * bounds[s] + 1
