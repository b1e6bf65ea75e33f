"""The legal levels as masks over the flattened MultiDiscrete action."""

from __future__ import annotations

from cps_envs.core.compiled import kernel
from cps_envs.core.types import BoolArray, IntArray


@kernel
def fill_masks(legal: IntArray, bounds: IntArray, masks: BoolArray) -> None:
    """Fill masks (B, sum(2 bounds + 1)) from the legal levels (B, S, 2); bounds (S,) are the largest levels.

    Where a state leaves a sensor nothing, the mask offers no injection: that move is illegal too, and ends the episode.
    """
    for b in range(masks.shape[0]):
        row, start = masks[b], 0
        row[:] = False
        for s in range(bounds.size):
            low, high = legal[b, s]
            if low > high:
                low = high = 0
            row[start + bounds[s] + low : start + bounds[s] + high + 1] = True
            start += 2 * bounds[s] + 1
