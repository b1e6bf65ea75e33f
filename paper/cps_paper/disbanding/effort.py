"""How many multiplications and divisions a decision of one vehicle takes, at least and at most, as they are built."""

from __future__ import annotations

import math

from cps_baselines.disbanding.heuristic_policy import Foresight
from cps_baselines.disbanding.quadratic_program import SWEEPS


def heuristic_products(foresight: Foresight, low_mps2: float, high_mps2: float) -> tuple[int, int]:
    """Algorithm 1: two distances; at most one command by (2.14), and every lower one that is tried."""
    distances = 2 * 2 * foresight.num_samples
    command = 5  # (2.14) and its horizon
    tried = 1 + math.ceil((high_mps2 - low_mps2) / foresight.decrement_mps2)
    return distances, distances + command + tried * (3 * foresight.num_samples + 2)


def mpc_products(horizon: int) -> tuple[int, int]:
    """Appendix A: the terms of the program, its optimum without limits, the limits; at most all sweeps of the dual."""
    rows = 5 * horizon - 4
    terms = 7 * horizon + 4 * (horizon - 2) + 4 * (horizon - 1)
    least = terms + horizon * horizon + rows * horizon
    return least, least + SWEEPS * rows * (rows + 1) + rows * horizon
