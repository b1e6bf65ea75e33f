"""The attacker's move: disbanding one of the paper's platoons 1..N at a whole second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.disbanding.commands import has_begun
from cps_envs.disbanding.lane import kernel
from cps_envs.disbanding.state import State

EARLIEST_S = 1.0  # constraint of (2.9): t_d >= 1


@kernel
def legal_attacks(
    step: NDArray[np.int64],
    disbanding_s: NDArray[np.float64],
    parameters: NDArray[np.void],
    budget: NDArray[np.int64],
    elapsed: NDArray[np.int64],
    interval: int,
    out: NDArray[np.bool_],
) -> None:
    """Fill `out` (B, N + 1): waiting (0) always; platoon i (1 = rear) while it is intact, present and affordable.

    `step` (B,) and `disbanding_s` (B, N) are those of the state: a call costs by the arrays that it is passed.
    Decisions are due when the game steps `elapsed` (B,) are a multiple of `interval`.
    """
    out[:] = False
    for b in range(out.shape[0]):
        out[b, 0] = True
        p = parameters[b]
        due = elapsed[b] % interval == 0 and budget[b] > 0
        if due and has_begun(step[b] * p.dt_s, EARLIEST_S):
            platoons = p.num_vehicles // p.vehicles_per_platoon
            for i in range(1, platoons + 1):
                out[b, i] = disbanding_s[b, platoons - i] == np.inf


@kernel
def disband(
    state: State,
    parameters: NDArray[np.void],
    budget: NDArray[np.int64],
    legal: NDArray[np.bool_],
    targets: NDArray[np.int64],
    lanes: NDArray[np.bool_],
) -> None:
    """Disband platoon targets[b] of the marked lanes now, where that is legal; anything else means waiting."""
    for b in range(lanes.shape[0]):
        i = targets[b]
        if lanes[b] and i > 0 and legal[b, i]:
            p = parameters[b]
            state.disbanding_s[b, p.num_vehicles // p.vehicles_per_platoon - i] = state.step[b] * p.dt_s
            budget[b] -= 1
