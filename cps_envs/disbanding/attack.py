"""The attacker's move: disbanding one of the paper's platoons 1..N at a whole second."""

from __future__ import annotations

import numpy as np

from cps_envs.core.kernels import inlined
from cps_envs.core.types import BoolArray, IntArray
from cps_envs.disbanding.controllers import has_begun
from cps_envs.disbanding.state import Constants, State

EARLIEST_S = 1.0  # constraint of (2.9): t_d >= 1


@inlined
def mark_legal(episode: State, c: Constants, budget: int, steps_per_decision: int, legal: BoolArray) -> None:
    """Fill `legal` (N + 1,): waiting (0) always; platoon i (1 = rear) while it is intact, present and affordable.

    Decisions are due every `steps_per_decision` integration steps.
    """
    step, platoons = episode.step[0], c.num_vehicles // c.vehicles_per_platoon
    due = step % steps_per_decision == 0 and budget > 0 and has_begun(step * c.dt_s, EARLIEST_S)
    legal[0] = True
    for i in range(1, legal.size):
        legal[i] = due and i <= platoons and episode.disbanding_s[platoons - i] == np.inf


@inlined
def disband(episode: State, c: Constants, target: int, budget: IntArray, legal: BoolArray) -> None:
    """Disband platoon `target` now where that is legal (N + 1,) and charge the `budget` (1,); else it means waiting."""
    if target > 0 and legal[target]:
        episode.disbanding_s[c.num_vehicles // c.vehicles_per_platoon - target] = episode.step[0] * c.dt_s
        budget[0] -= 1
