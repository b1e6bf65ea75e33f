"""What the attacker is paid: the velocity error, a penalty for collisions, and the charge of an early end."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.metrics import METRICS
from cps_envs.disbanding.state import State

CHARGES = (
    "collision_penalty",  # points of E_v, for intact vehicles involved in collisions, scaled by 100 / M
    "end_charge",  # points of E_v, the rest of an episode ended by a collision at 100 %
    "disbanded_platoons",  # how many; not paid
)
COLLIDED_INTACT = METRICS.index("collided_intact")


class Rules(NamedTuple):
    """What a turn needs of the configuration."""

    horizon_steps: int  # integration steps in an episode
    collision_penalty: float  # points of E_v per 100/M vehicles
    velocity_error: int  # column of METRICS that is paid
    steps_per_decision: int  # integration steps between two decisions of the attacker


@kernel
def charge(
    state: State,
    parameters: NDArray[np.void],
    rules: Rules,
    table: NDArray[np.float64],
    total: NDArray[np.float64],
) -> None:
    """Fill the columns CHARGES of `table` (B, len(METRICS + CHARGES)) and the attacker's payoff `total` (B,) so far."""
    first = len(METRICS)
    for b in range(total.shape[0]):
        p = parameters[b]
        table[b, first] = rules.collision_penalty * 100.0 / p.num_vehicles * table[b, COLLIDED_INTACT]
        ended = p.stop_at_collision and table[b, COLLIDED_INTACT] > 0.0
        table[b, first + 1] = 100.0 * (1.0 - state.step[b] / rules.horizon_steps) if ended else 0.0
        table[b, first + 2] = disbanded(state, b)
        total[b] = table[b, rules.velocity_error] + table[b, first] + table[b, first + 1]


@kernel
def disbanded(state: State, b: int) -> int:
    """Number of disbanded platoons of episode `b`."""
    count = 0
    for platoon in range(state.disbanding_s.shape[1]):
        if state.disbanding_s[b, platoon] < np.inf:
            count += 1
    return count
