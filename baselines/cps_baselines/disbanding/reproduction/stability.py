"""String stability of the published gains over the length of a platoon and the actuation lag, as a table and a plot."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from cps_baselines.disbanding.string_stability import Peak, peak_gain, rear_to_rear_gain
from cps_baselines.reproduction.figures import MARKERS, dress, new_figure, shades

SIZES = tuple(range(2, 16))  # n
TAUS_S = (0.1, 0.2, 0.3, 0.4, 0.5)
PAPER_SIZE = 10
SHOWN_SIZES = (2, 3, 5, 8, 10, 15)
STABLE_GAIN = 1.0 + 1e-4  # the gain at frequency 0 is 1; above this a disturbance grows


@dataclass(frozen=True)
class Stability:
    """Peak gains by (n, tau in s)."""

    peaks: dict[tuple[int, float], Peak]

    @property
    def stable_sizes(self) -> dict[float, list[int]]:
        """The n for which no disturbance grows, by tau."""
        return {tau_s: [size for size in SIZES if self.peaks[size, tau_s].gain <= STABLE_GAIN] for tau_s in TAUS_S}

    def verdict(self) -> str:
        """What this says about section 2.2.1."""
        found = [self.peaks[PAPER_SIZE, tau_s] for tau_s in (TAUS_S[0], TAUS_S[-1])]
        if all(PAPER_SIZE in sizes for sizes in self.stable_sizes.values()):
            return "No disturbance grows from platoon to platoon, as section 2.2.1 says."
        stable = "; ".join(
            f"tau {tau_s:g} s: {', '.join(map(str, sizes)) or 'none'}" for tau_s, sizes in self.stable_sizes.items()
        )
        return (
            f'This contradicts section 2.2.1, where bidirectional control "is able to guarantee platoon string '
            f"stability\". With the published gains and the paper's n = {PAPER_SIZE} the speed of a platoon's last "
            f"vehicle swings up to {found[0].gain:.2f} times (tau {TAUS_S[0]:g} s) to {found[1].gain:.2f} times (tau "
            f"{TAUS_S[-1]:g} s) as much as that of the platoon ahead, at periods of {found[0].period_s:.0f} s and "
            f"{found[1].period_s:.0f} s, and grows by that factor from platoon to platoon until speeds reach their "
            f"limits. The string is stable only for these n: {stable}."
        )


@lru_cache(maxsize=1)
def analyse() -> Stability:
    """All peaks."""
    return Stability({(size, tau_s): peak_gain(size, tau_s) for size in SIZES for tau_s in TAUS_S})


def draw(stability: Stability) -> Any:
    """Gain over the period at the paper's lag, and peak gain over the number of vehicles."""
    figure = new_figure(11.0, 4.4)
    left, right = figure.subplots(1, 2)
    frequencies = np.geomspace(2 * np.pi / 1000.0, 2 * np.pi / 5.0, 600)
    for size, color in zip(SHOWN_SIZES, shades(len(SHOWN_SIZES)), strict=True):
        gains = rear_to_rear_gain(size, TAUS_S[0], frequencies)
        left.semilogx(2 * np.pi / frequencies, gains, color=color, label=f"n = {size}")
    dress(
        left,
        f"Frequency response, tau = {TAUS_S[0]:g} s",
        "period of the disturbance / s",
        "gain, rear to rear vehicle",
    )
    left.set_xlim(5, 1000)
    left.set_xticks([5, 10, 20, 50, 100, 200, 500, 1000], ["5", "10", "20", "50", "100", "200", "500", "1000"])
    left.minorticks_off()
    for tau_s, color, marker in zip(TAUS_S, shades(len(TAUS_S)), MARKERS, strict=True):
        peaks = [stability.peaks[size, tau_s].gain for size in SIZES]
        right.plot(SIZES, peaks, color=color, marker=marker, markersize=4, label=f"tau = {tau_s:g} s")
    dress(right, "Peak gain", "vehicles per platoon n", "largest gain over all frequencies")
    right.set_xticks(SIZES)
    for axes in (left, right):
        axes.axhline(1.0, color="0.3", linewidth=0.9, linestyle="--")
        axes.set_ylim(0)
        axes.legend(fontsize=8, frameon=False)
    right.annotate(
        "string-stable up to this line", (SIZES[-1], 1.0), (0, -12), textcoords="offset points", ha="right", fontsize=8
    )
    figure.suptitle("Speed of a platoon's last vehicle against that of the platoon ahead (k_p = 1, k_d = 5, h = 1.5 s)")
    return figure
