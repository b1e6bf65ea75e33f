"""Damage over the attacker's frequency and power, as in Figs. 5.6 to 5.11, and the collision line of section 5.4."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp

import numpy as np
from scipy.optimize import brentq

from cps_envs.core.types import FloatArray
from cps_envs.rogue.config import PAPER, RogueConfig


@dataclass(frozen=True)
class HeatMap:
    """Damages (R, F) of square waves at R power ratios and F frequencies, both rising."""

    ratios: Sequence[float]
    frequencies_hz: Sequence[float]
    damage: FloatArray

    @property
    def highest(self) -> float:
        """The maximum."""
        return float(self.damage.max())

    @property
    def mean(self) -> float:
        """Over all cells."""
        return float(self.damage.mean())

    @property
    def peak(self) -> tuple[float, float]:
        """Frequency in Hz and power ratio of the maximum."""
        row, column = divmod(int(self.damage.argmax()), len(self.frequencies_hz))
        return self.frequencies_hz[column], self.ratios[row]

    @property
    def low(self) -> FloatArray:
        """The means (R,) of each row's lower half of the frequencies, without the middle one."""
        return np.asarray(self.damage[:, : len(self.frequencies_hz) // 2].mean(axis=1))

    @property
    def high(self) -> FloatArray:
        """The means (R,) of each row's upper half of the frequencies, without the middle one."""
        return np.asarray(self.damage[:, -(len(self.frequencies_hz) // 2) :].mean(axis=1))

    @property
    def last_harmful_hz(self) -> list[float]:
        """The highest frequency with any damage at each ratio; 0 where there is none."""
        frequencies = np.array(self.frequencies_hz)
        return [float(frequencies[row > 0].max(initial=0.0)) for row in self.damage]

    def row(self, power_ratio: float) -> FloatArray:
        """The damages (F,) at a ratio."""
        return np.asarray(self.damage[list(self.ratios).index(power_ratio)])

    def window(self, first_hz: float, last_ratio: float) -> HeatMap:
        """The part from a frequency and up to a ratio."""
        columns = [k for k, frequency in enumerate(self.frequencies_hz) if frequency >= first_hz]
        rows = [k for k, ratio in enumerate(self.ratios) if ratio <= last_ratio]
        return HeatMap(
            [self.ratios[k] for k in rows],
            [self.frequencies_hz[k] for k in columns],
            self.damage[np.ix_(rows, columns)],
        )


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
