"""A turn of the game in one kernel call: both moves, the physics, and what is measured afterwards."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.rogue.dynamics import advance_episode
from cps_envs.rogue.kernel import kernel
from cps_envs.rogue.metrics import measure
from cps_envs.rogue.state import State


@kernel
def take_turn(
    state: State,
    attack: NDArray[np.float64],
    orders: NDArray[np.int64],
    accelerations: NDArray[np.float64],
    envs: NDArray[np.bool_],
    periods: int,
    rules: NDArray[np.void],
    table: NDArray[np.float64],
) -> None:
    """Advance the marked environments (B,) by game steps and fill `table` (B, len(METRICS)).

    `attack` (B, 1) in [-1, 1]; `orders` (B, n - 1, 2) laws and whether they are modified; `accelerations` (B, n - 1)
    m/s2, for vehicles whose law is `COMMANDED`.
    """
    for b in range(envs.shape[0]):
        if envs[b]:
            advance_episode(
                state.vehicles[b],
                state.pairs[b],
                state.episode[b],
                state.log[b],
                attack[b, 0],
                orders[b],
                accelerations[b],
                periods,
                rules[0],
            )
    measure(state, rules, table)
