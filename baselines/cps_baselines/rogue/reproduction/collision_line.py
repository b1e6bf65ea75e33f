"""The frequency above which "a suitable control scheme" could avoid collisions, section 5.4."""

from __future__ import annotations

from math import exp

from scipy.optimize import brentq

from cps_envs.rogue.config import PAPER, RogueConfig

LONGEST_S = 1e4


def collision_frequency_hz(power_ratio: float, gap_m: float, config: RogueConfig = PAPER) -> float:
    """f_col = 1 / (2 t_col): both vehicles at full effort from equal speed close `gap_m` in t_col; 0 if they never do.

    The attacker gains (ratio - 1) alpha F+ of acceleration, against which the drag of the difference in speed acts.
    """
    gain_mps2 = (power_ratio - 1.0) * config.drive_mps2 * config.max_effort  # type: ignore[operator]
    drag_per_s = float(config.drag_per_s)  # type: ignore[arg-type]

    def left_m(time_s: float) -> float:
        closed = gain_mps2 / drag_per_s * (time_s - (1.0 - exp(-drag_per_s * time_s)) / drag_per_s)
        return float(gap_m - closed)

    return 0.0 if left_m(LONGEST_S) > 0 else 1.0 / (2.0 * brentq(left_m, 0.0, LONGEST_S))


def bumper_gap_m(config: RogueConfig = PAPER) -> float:
    """Between bumpers in steady state, where contact is; the paper's formula takes centres, `separation_m` apart."""
    return config.separation_m - config.vehicle_length_m
