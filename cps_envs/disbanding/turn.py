"""A turn of the game in one kernel call: both moves, the physics, and what everybody may know afterwards.

A call costs by the arrays that it is passed, some 8 microseconds for a state; hence one call and not five.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.attack import disband, legal_attacks
from cps_envs.disbanding.dynamics import advance
from cps_envs.disbanding.metrics import measure
from cps_envs.disbanding.payoff import Rules, charge
from cps_envs.disbanding.state import State


class Account(NamedTuple):
    """What is known after a turn."""

    table: NDArray[np.float64]  # (B, len(METRICS + CHARGES))
    total: NDArray[np.float64]  # (B,) the attacker's payoff so far
    legal: NDArray[np.bool_]  # (B, N + 1) attacks


@kernel
def settle(
    state: State, parameters: NDArray[np.void], budget: NDArray[np.int64], rules: Rules, account: Account
) -> None:
    """Bring the account up to the state."""
    measure(state, parameters, rules.horizon_steps, account.table)
    charge(state, parameters, rules, account.table, account.total)
    legal_attacks(state, parameters, budget, rules.steps_per_decision, account.legal)


@kernel
def take_turn(
    state: State,
    parameters: NDArray[np.void],
    budget: NDArray[np.int64],
    targets: NDArray[np.int64],
    correction: NDArray[np.float64],
    envs: NDArray[np.bool_],
    num_steps: int,
    rules: Rules,
    account: Account,
) -> None:
    """Disband `targets` (B,) where that is legal, advance marked environments under `correction` (B, M), and settle."""
    disband(state, parameters, budget, account.legal, targets, envs)
    advance(state, parameters, correction, envs, num_steps)
    settle(state, parameters, budget, rules, account)
