"""Damage over the attacker's frequency and power, as in Figs. 5.6 to 5.11."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cps_envs.core.types import FloatArray


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
