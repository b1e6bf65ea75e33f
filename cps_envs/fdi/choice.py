"""From the attacker's action to a level of each sensor."""

from __future__ import annotations

import math

from cps_envs.core.kernels import inlined
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.legality import legal_levels, nearest
from cps_envs.fdi.memory import Constants, Matrices, Memory


@inlined
def choose_levels(
    action: IntArray,
    memory: Memory,
    c: Constants,
    m: Matrices,
    sensors: IntArray,
    interval: IntArray,
    level: IntArray,
    row: FloatArray,
) -> None:
    """Fill the levels (S,) of an action (S,): a level plus its bound, or a share of the legal interval.

    Sensors choose in their order: what the earlier ones took narrows the interval of the later ones. Action 0 of the
    share form injects nothing; 1 is the lowest legal level, the last one the highest. A shield takes the nearest level
    of the interval; clipped limits do the same. `interval` (S, 2) and `row` (S,) are scratch.
    """
    n = memory.law.size
    for s in range(sensors.size):
        if sensors[s] < 0:
            level[s] = 0
            continue
        wish = action[s] - int(c.range_levels if sensors[s] < n else c.rate_levels)
        if c.by_share > 0 or c.shield > 0 or c.clip > 0:
            legal_levels(memory, c, m, sensors, level, s, interval, row)
            low, high = interval[s, 0], interval[s, 1]
            if c.by_share > 0:
                share = (action[s] - 1) / (c.share_levels - 1)
                wish = low + math.floor(share * (high - low) + 0.5) if action[s] > 0 and low <= high else 0
            if low <= high and not (c.by_share > 0 and action[s] == 0 and c.shield == 0 and c.clip == 0):
                wish = nearest(wish, low, high)
        level[s] = wish
