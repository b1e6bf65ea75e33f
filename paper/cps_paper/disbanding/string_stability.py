"""Does a disturbance grow from platoon to platoon? Frequency response of the linear laws (2.1) to (2.4).

The text of section 2.2.1 says that bidirectional control guarantees string stability. For ten vehicles it does not: the
gain from the speed of one platoon's last vehicle to that of the next exceeds one at periods around 40 s.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from cps_envs.core.types import FloatArray
from cps_envs.disbanding.config import PAPER
from cps_paper.disbanding.experiments import DisbandingEvidence
from cps_paper.exhibit import Column, ExhibitTable, across
from cps_paper.figures import add_legend, dress, marked_curves, new_figure, shades

SIZES = tuple(range(2, 16))  # n
LAGS_S = (0.1, 0.2, 0.3, 0.4, 0.5)
PAPER_SIZE = 10
SHOWN_SIZES = (2, 3, 5, 8, 10, 15)
STABLE_GAIN = 1.0 + 1e-4  # the gain at frequency 0 is 1; above this a disturbance grows
FREQUENCIES_RAD_S = np.geomspace(1e-3, 10.0, 2000)


class Peak(NamedTuple):
    """The largest amplification and where it lies."""

    gain: float
    frequency_rad_s: float

    @property
    def period_s(self) -> float:
        """Period of the disturbance that grows most."""
        return float(2.0 * np.pi / self.frequency_rad_s)


def platoon_matrices(num_vehicles: int, tau_s: float) -> tuple[FloatArray, FloatArray]:
    """A (3n, 3n) and B (3n, 2) of one platoon's deviations [x, v, a], leader first; inputs: x and v of who is ahead."""
    n, k_p, k_d = num_vehicles, PAPER.proportional_gain, PAPER.derivative_gain
    position, speed = np.zeros((n, n)), np.zeros((n, n))  # u = position @ x + speed @ v + ahead @ inputs
    for i in range(n):
        middle = 0 < i < n - 1
        for j, sign in ((i, -2.0 if middle else -1.0), (i - 1, 1.0), (i + 1, 1.0 if middle else 0.0)):
            if 0 <= j < n:
                position[i, j], speed[i, j] = sign * k_p, sign * k_d  # type: ignore[operator]
    speed[0, 0] -= k_p * PAPER.headway_s  # type: ignore[operator]
    identity, zero = np.eye(n), np.zeros((n, n))
    a = np.block([[zero, identity, zero], [zero, zero, identity], [position / tau_s, speed / tau_s, -identity / tau_s]])
    b = np.zeros((3 * n, 2))
    b[2 * n] = np.array([k_p, k_d]) / tau_s
    return a, b


def rear_to_rear_gain(num_vehicles: int, tau_s: float, frequencies_rad_s: FloatArray) -> FloatArray:
    """|v_last / v_last of the platoon ahead| at each frequency (F,)."""
    a, b = platoon_matrices(num_vehicles, tau_s)
    s = 1j * np.asarray(frequencies_rad_s)[:, np.newaxis, np.newaxis]
    inputs = b[:, :1] + s * b[:, 1:]  # of a unit position ahead
    response = np.linalg.solve(s * np.eye(len(a)) - a, inputs)
    gain: FloatArray = np.abs(response[:, num_vehicles - 1, 0])
    return gain


def peak_gain(num_vehicles: int, tau_s: float) -> Peak:
    """The largest gain over all frequencies; 1 at frequency 0 where nothing is amplified."""

    def attenuation(log_frequency: float) -> float:
        return -float(rear_to_rear_gain(num_vehicles, tau_s, np.exp([log_frequency]))[0])

    grid = rear_to_rear_gain(num_vehicles, tau_s, FREQUENCIES_RAD_S)
    best = int(np.argmax(grid))
    around = np.log(FREQUENCIES_RAD_S[[max(best - 1, 0), min(best + 1, len(grid) - 1)]])
    found = minimize_scalar(attenuation, bounds=tuple(around), method="bounded", options={"xatol": 1e-8})
    return Peak(-float(found.fun), float(np.exp(found.x)))


@dataclass(frozen=True)
class Stability:
    """Peak gains by (n, tau in s)."""

    peaks: dict[tuple[int, float], Peak]

    @property
    def stable_sizes(self) -> dict[float, list[int]]:
        """The n for which no disturbance grows, by tau."""
        return {tau_s: [size for size in SIZES if self.peaks[size, tau_s].gain <= STABLE_GAIN] for tau_s in LAGS_S}

    def verdict(self) -> str:
        """What this says about section 2.2.1."""
        found = [self.peaks[PAPER_SIZE, tau_s] for tau_s in (LAGS_S[0], LAGS_S[-1])]
        if all(PAPER_SIZE in sizes for sizes in self.stable_sizes.values()):
            return "No disturbance grows from platoon to platoon, as section 2.2.1 says."
        stable = "; ".join(
            f"tau {tau_s:g} s: {', '.join(map(str, sizes)) or 'none'}" for tau_s, sizes in self.stable_sizes.items()
        )
        return (
            f'This contradicts section 2.2.1, where bidirectional control "is able to guarantee platoon string '
            f"stability\". With the published gains and the paper's n = {PAPER_SIZE} the speed of a platoon's last "
            f"vehicle swings up to {found[0].gain:.2f} times (tau {LAGS_S[0]:g} s) to {found[1].gain:.2f} times (tau "
            f"{LAGS_S[-1]:g} s) as much as that of the platoon ahead, at periods of {found[0].period_s:.0f} s and "
            f"{found[1].period_s:.0f} s, and grows by that factor from platoon to platoon until speeds reach their "
            f"limits. The string is stable only for these n: {stable}."
        )


@lru_cache(maxsize=1)
def analyse() -> Stability:
    """All peaks."""
    return Stability({(size, tau_s): peak_gain(size, tau_s) for size in SIZES for tau_s in LAGS_S})


def stability_tables(seen: DisbandingEvidence) -> list[ExhibitTable]:
    """Peak gains, and what they say; from the linear controllers alone."""
    stability, title = analyse(), "Peak gain, and the frequency in rad/s and period where it lies"

    def shown(size: int, tau_s: float) -> str:
        peak = stability.peaks[size, tau_s]
        where = f"  {peak.frequency_rad_s:.3f} {peak.period_s:5.0f} s" if peak.gain > STABLE_GAIN else f"{'':15}"
        return f"{peak.gain:.3f}{where}"

    columns = (Column("n", str), *across(LAGS_S, "tau = {:g} s".format, shown))
    return [ExhibitTable(title, columns, SIZES, (stability.verdict(),))]


def stability_data(seen: DisbandingEvidence) -> dict[str, Any]:
    """The same as plain data."""
    stability = analyse()
    return {
        "peaks": [
            {"vehicles_per_platoon": size, "tau_s": tau_s, **peak._asdict(), "period_s": peak.period_s}
            for (size, tau_s), peak in stability.peaks.items()
        ],
        "stable_sizes": {f"{tau_s:g}": sizes for tau_s, sizes in stability.stable_sizes.items()},
        "verdict": stability.verdict(),
    }


def draw_stability(seen: DisbandingEvidence) -> Any:
    """Gain over the period at the paper's lag, and peak gain over the number of vehicles."""
    stability = analyse()
    title = "Speed of a platoon's last vehicle against that of the platoon ahead (k_p = 1, k_d = 5, h = 1.5 s)"
    figure = new_figure(11.0, 6.5, title)
    left, right = figure.subplots(1, 2)
    frequencies = np.geomspace(2 * np.pi / 1000.0, 2 * np.pi / 5.0, 600)
    for size, color in zip(SHOWN_SIZES, shades(len(SHOWN_SIZES)), strict=True):
        gains = rear_to_rear_gain(size, LAGS_S[0], frequencies)
        left.semilogx(2 * np.pi / frequencies, gains, color=color, label=f"n = {size}")
    title, x = f"Frequency response, tau = {LAGS_S[0]:g} s", "period of the disturbance / s"
    dress(left, title, x, "gain, rear to rear vehicle", x_limits=(5, 1000))
    left.set_xticks([5, 10, 20, 50, 100, 200, 500, 1000], ["5", "10", "20", "50", "100", "200", "500", "1000"])
    left.minorticks_off()
    peaks = {f"tau = {tau_s:g} s": [stability.peaks[size, tau_s].gain for size in SIZES] for tau_s in LAGS_S}
    marked_curves(right, SIZES, peaks)
    dress(right, "Peak gain", "vehicles per platoon n", "largest gain over all frequencies")
    for axes in (left, right):
        axes.axhline(1.0, color="0.3", linewidth=0.9, linestyle="--")
        axes.set_ylim(0)
        add_legend(axes)
    right.annotate(
        "string-stable up to this line", (SIZES[-1], 1.0), (0, -12), textcoords="offset points", ha="right", fontsize=8
    )
    return figure
