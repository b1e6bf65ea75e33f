"""Damage over the attacker's frequency and power, as in Figs. 5.6 to 5.11, and the collision line of section 5.4.

Axes and names of the chapter's figures, some of which the paper leaves out (specification 3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp

import numpy as np
from scipy.optimize import brentq

from cps_envs.core.types import FloatArray
from cps_envs.rogue.config import PAPER

PASS, SOLID = "pass", "solid"
CONTACTS: Mapping[str, str] = {PASS: "m", SOLID: "m/s"}  # unit of the damage
MAPS: Mapping[str, str] = {  # figure -> defender
    "5.6": "pd",
    "5.7": "sliding",
    "5.8": "sliding_detection",
    "5.9": "disband_2",
    "5.10": "disband_4",
    "5.11": "disband_7",
}
FIGURES: Mapping[str, str] = {defender: figure for figure, defender in MAPS.items()}
DETECTION_OVER_LINEAR = "pd_detection"  # Fig. 5.1b read with section 5.2.3; in no map of the paper
TITLES: Mapping[str, str] = {
    DETECTION_OVER_LINEAR: "linear with detection",
    "pd": "linear bidirectional",
    "sliding": "sliding mode",
    "sliding_detection": "sliding mode with detection",
    "disband_2": "modified, +2 m",
    "disband_4": "modified, +4 m",
    "disband_7": "modified, +7 m",
}
FREQUENCIES_HZ = tuple(np.round(np.linspace(0.02, 0.5, 17), 3).tolist())  # chosen
CIRCLED = "disband_7"  # whose errors Fig. 5.4 shows
COURSES = {"5.3": ("sliding", "sliding_detection"), "5.5": ("disband_2",)}
RATIOS = (1.0, 1.1, 1.2, 1.3, 1.4)  # chosen
DISBANDING = ("disband_2", "disband_4", "disband_7")
COURSE_FREQUENCIES_HZ = (0.02, 0.05, 0.1)  # chosen; the paper names none for Figs. 5.3 and 5.5
DRAWN_HZ = 0.05  # of these, the one that the figures show
LEARNING_S = 60.0  # duration of the learning problem
STEADY_HZ = tuple(np.round(np.linspace(0.01, 0.6, 40), 4).tolist())  # among which the best square wave is sought
SEATED = (*MAPS.values(), DETECTION_OVER_LINEAR)  # who plays with the attacker in other seats
SEATS: Mapping[int, tuple[int, ...]] = {5: (1, 2, 3, 4), 10: (1, 5, 9)}  # of so many vehicles; 1 = rear; chosen
SEAT_RATIOS = (1.0, 1.2, 1.4)  # chosen: three of `RATIOS`, since the maps are many
FINE_S = 0.0005  # integration step that is stable for all of these
SWAYS = (  # attacker and power ratio: the gains of (5.15) after a kick, and the sign of k_d reversed
    ("gains?derivative=3", 1.0),
    ("gains", 1.0),
    ("gains", 2.0),
)
WIDE_RATIOS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0)


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


def collision_frequency_hz(power_ratio: float, gap_m: float) -> float:
    """f_col = 1 / (2 t_col): both vehicles at full effort from equal speed close `gap_m` in t_col; 0 if they never do.

    The attacker gains (ratio - 1) alpha F+ of acceleration, against which the drag of the difference in speed acts.
    """
    gain_mps2 = (power_ratio - 1.0) * PAPER.drive_mps2 * PAPER.max_effort  # type: ignore[operator]
    drag_per_s = float(PAPER.drag_per_s)  # type: ignore[arg-type]

    def left_m(time_s: float) -> float:
        closed = gain_mps2 / drag_per_s * (time_s - (1.0 - exp(-drag_per_s * time_s)) / drag_per_s)
        return float(gap_m - closed)

    return 0.0 if left_m(LONGEST_S) > 0 else 1.0 / (2.0 * brentq(left_m, 0.0, LONGEST_S))


def bumper_gap_m() -> float:
    """Between bumpers in steady state, where contact is; the paper's formula takes centres, `separation_m` apart."""
    return PAPER.separation_m - PAPER.vehicle_length_m  # type: ignore[operator]
