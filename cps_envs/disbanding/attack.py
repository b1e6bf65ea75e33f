"""The attacker's move: disbanding one of the paper's platoons 1..N at a whole second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.commands import has_begun
from cps_envs.disbanding.state import State

EARLIEST_S = 1.0  # constraint of (2.9): t_d >= 1


@kernel
def legal_attacks(
    state: State,
    parameters: NDArray[np.void],
    budget: NDArray[np.int64],
    steps_per_decision: int,
    out: NDArray[np.bool_],
) -> None:
    """Fill `out` (B, N + 1): waiting (0) always; platoon i (1 = rear) while it is intact, present and affordable.

    Decisions are due every `steps_per_decision` integration steps.
    """
    out[:] = False
    for b in range(out.shape[0]):
        out[b, 0] = True
        p, step = parameters[b], state.step[b]
        due = step % steps_per_decision == 0 and budget[b] > 0
        if due and has_begun(step * p.dt_s, EARLIEST_S):
            platoons = p.num_vehicles // p.vehicles_per_platoon
            for i in range(1, platoons + 1):
                out[b, i] = state.disbanding_s[b, platoons - i] == np.inf


@kernel
def disband(
    state: State,
    parameters: NDArray[np.void],
    budget: NDArray[np.int64],
    legal: NDArray[np.bool_],
    targets: NDArray[np.int64],
    envs: NDArray[np.bool_],
) -> None:
    """Disband platoon targets[b] of the marked environments now, where that is legal; anything else means waiting."""
    for b in range(envs.shape[0]):
        i = targets[b]
        if envs[b] and i > 0 and legal[b, i]:
            p = parameters[b]
            state.disbanding_s[b, p.num_vehicles // p.vehicles_per_platoon - i] = state.step[b] * p.dt_s
            budget[b] -= 1
