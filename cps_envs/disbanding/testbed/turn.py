"""A turn of the game on robots in one kernel call: both moves, the control loop, and what may be known afterwards."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.kernels import kernel
from cps_envs.disbanding.attack import disband, legal_attacks
from cps_envs.disbanding.metrics import measure
from cps_envs.disbanding.state import State
from cps_envs.disbanding.testbed.loop import run
from cps_envs.disbanding.testbed.metrics import velocity_errors
from cps_envs.disbanding.testbed.rules import Rules
from cps_envs.disbanding.testbed.state import Floats, Robots


class Account(NamedTuple):
    """What is known after a turn."""

    table: Floats  # (B, len(disbanding.metrics.METRICS)) of the string as the filters see it
    velocity_error: Floats  # (B,) percent, of the robots as they are
    budget: NDArray[np.int64]  # (B,) platoons that the attacker may still disband
    legal: NDArray[np.bool_]  # (B, N + 1) attacks


@kernel
def settle(robots: Robots, string: State, parameters: NDArray[np.void], rules: Rules, account: Account) -> None:
    """Bring the account up to the state."""
    measure(string, parameters, rules.num_periods, account.table)
    velocity_errors(robots.error, string.disbanding_s, rules, account.velocity_error)
    legal_attacks(string, parameters, account.budget, rules.periods_per_attack, account.legal)


@kernel
def take_turn(
    robots: Robots,
    string: State,
    parameters: NDArray[np.void],
    targets: NDArray[np.int64],
    correction: Floats,
    envs: NDArray[np.bool_],
    num_periods: int,
    rules: Rules,
    account: Account,
) -> None:
    """Disband `targets` (B,) where legal, run marked environments under `correction` (B, M) in m/s2 of road; settle."""
    disband(string, parameters, account.budget, account.legal, targets, envs)
    run(robots, string, parameters, correction, envs, num_periods, rules)
    settle(robots, string, parameters, rules, account)
