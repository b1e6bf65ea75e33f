"""Two measures of the machine: Gymnasium's CartPole, and the simplest vehicle in a compiled loop."""

from __future__ import annotations

import numpy as np

from cps_agents.bench.interfaces import CARTPOLE, single
from cps_agents.bench.row import Yardsticks, calls_per_s
from cps_envs.core.kernels import kernel
from cps_envs.core.types import FloatArray

VEHICLES = 256  # their positions and speeds stay in the first-level cache
SWEEPS = 200  # 2 s
LINE = 64  # bytes of a line of the cache; arrays that begin elsewhere make the loop half as fast


@kernel
def drive(position: FloatArray, speed: FloatArray, sweeps: int) -> None:
    """Vehicles (n,) that a linear controller steers to 5 m, one step of 0.01 s after the other.

    Three multiplications and four additions a vehicle and step, no branch, no division, no neighbour: what the
    processor's vector units reach in float64 at best, and what no real simulation does.
    """
    for i in range(position.size):
        position[i], speed[i] = 0.0, 1.0
    for _ in range(sweeps):
        for i in range(position.size):
            speed[i] += 0.01 * ((5.0 - position[i]) - 3.0 * speed[i])
            position[i] += 0.01 * speed[i]


def measure_yardsticks(seconds: float) -> Yardsticks:
    """Both, with about `seconds` of CPU for each."""
    position, speed = _arrays()
    updates = VEHICLES * SWEEPS * calls_per_s(lambda: drive(position, speed, SWEEPS), seconds)
    return Yardsticks(1e6 / calls_per_s(single(CARTPOLE), seconds), updates)


def _arrays() -> tuple[FloatArray, FloatArray]:
    """Positions and speeds (n,), each at the beginning of a line of the cache and with different places in it."""
    room = np.empty(3 * VEHICLES * 8, np.uint8)
    start, size = -room.ctypes.data % LINE, VEHICLES * 8
    second = start + size + LINE
    return room[start : start + size].view(np.float64), room[second : second + size].view(np.float64)
