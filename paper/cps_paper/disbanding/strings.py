"""Fig. 2.1 in numbers: courses of platoons, recovery of strings, stops and collisions under many attacks.

String stability of the published gains, over the length of a platoon and the actuation lag, is a table and a plot.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from cps_envs.disbanding.dynamics import STOP_MPS
from cps_paper.disbanding.claims_2_1 import NEARLY_STOPPED_MPS
from cps_paper.disbanding.experiments import STRINGS, TAUS_S, DisbandingEvidence
from cps_paper.disbanding.rules import CLAIMS
from cps_paper.disbanding.scenario import ScenarioCourse
from cps_paper.disbanding.string_stability import Peak, peak_gain, rear_to_rear_gain
from cps_paper.evidence import NotRunError
from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.figures import add_legend, dress, marked_curves, new_figure, shades
from cps_paper.verdicts import RECOVERY_RULE

SIZES = tuple(range(2, 16))  # n
LAGS_S = (0.1, 0.2, 0.3, 0.4, 0.5)
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


def draw(stability: Stability) -> Any:
    """Gain over the period at the paper's lag, and peak gain over the number of vehicles."""
    title = "Speed of a platoon's last vehicle against that of the platoon ahead (k_p = 1, k_d = 5, h = 1.5 s)"
    figure = new_figure(11.0, 4.4, title)
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


SHOWN = (20, 19, 15, 10, 1)  # platoons in the legends of Figs. 2.1a-c
RECOVERY_CLAIMS = ("P13", "P15", "P16")


@dataclass(frozen=True)
class PlatoonCourse:
    """What a platoon of the string of 20 went through; gaps are those between its vehicles."""

    platoon: int
    smallest_gap_m: float
    largest_gap_m: float
    settled_s: float | None
    stopped_s: float  # all of its vehicles at once
    slowest_mps: float
    top_speed_mps: float  # of its leader


@dataclass(frozen=True)
class StringCourse:
    """What a string of platoons went through."""

    num_platoons: int
    rear_stopped_s: float
    recovered_min: float | None
    duration_min: float
    paper_min: float


@dataclass(frozen=True)
class EveryOther:
    """Shares of the intact vehicles in percent when every other platoon is disbanded."""

    tau_s: float
    stops: tuple[float, float, float]  # at least once, twice, three times
    collided: float
    rear_collided: float


def courses_tables(evidence: DisbandingEvidence) -> list[ExhibitTable]:
    """What Figs. 2.1a-c, d and e show, in numbers, as far as they were simulated."""
    twenty = evidence[evidence.string(STRINGS[0])]
    platoons = [_platoon(twenty, platoon) for platoon in SHOWN]
    others = [_every_other(evidence, tau_s) for tau_s in TAUS_S[:2]]
    return [
        ExhibitTable(
            "Figs. 2.1a-c: 20 platoons, the lead one (20) disbanded at 2 s; gaps inside a platoon",
            PLATOON_COLUMNS,
            platoons,
            key="platoons",
            data=asdict,
        ),
        ExhibitTable(
            "Fig. 2.1d: the rear vehicle behind strings of platoons",
            STRING_COLUMNS,
            _strings(evidence),
            (STRING_NOTE,),
            key="strings",
            data=asdict,
        ),
        ExhibitTable(
            "Fig. 2.1e: every other of 20 platoons disbanded, 30 s apart",
            OTHER_COLUMNS,
            others,
            (OTHER_NOTE,),
            footer=PAPER_SHARES,
            key="every_other",
            data=asdict,
        ),
    ]


def _strings(evidence: DisbandingEvidence) -> list[StringCourse]:
    found = []
    for count, claim in zip(STRINGS, RECOVERY_CLAIMS, strict=True):
        with suppress(NotRunError):
            found.append(_string(evidence[evidence.string(count)], CLAIMS.number(claim)))
    return found


def _platoon(record: ScenarioCourse, platoon: int) -> PlatoonCourse:
    gaps, speed = record.inner_gaps(platoon), record.speed_mps[:, record.vehicles(platoon)]
    return PlatoonCourse(
        platoon=platoon,
        smallest_gap_m=float(gaps.min()),
        largest_gap_m=float(gaps.max()),
        settled_s=record.settled_s(platoon),
        stopped_s=record.duration_s(speed.max(axis=1) < NEARLY_STOPPED_MPS),
        slowest_mps=float(speed.min()),
        top_speed_mps=float(speed[:, 0].max()),
    )


def _string(record: ScenarioCourse, paper_min: float) -> StringCourse:
    recovered = record.recovered_s()
    return StringCourse(
        num_platoons=record.config.max_platoons,
        rear_stopped_s=record.duration_s(record.speed_mps[:, -1] < STOP_MPS),
        recovered_min=None if recovered is None else recovered / 60.0,
        duration_min=float(record.time_s[-1]) / 60.0,
        paper_min=paper_min,
    )


def _every_other(evidence: DisbandingEvidence, tau_s: float) -> EveryOther:
    outcome = evidence[evidence.every_other(tau_s)]
    once, twice, thrice = (outcome.stopped_share(times) for times in (1, 2, 3))
    rear = 100.0 * float(outcome.rear_collided[outcome.intact].mean())
    return EveryOther(tau_s, (once, twice, thrice), outcome.collided_share(), rear)


def _recovered(row: StringCourse) -> str:
    return f"never in {row.duration_min:.0f} min" if row.recovered_min is None else f"{row.recovered_min:.1f} min"


PLATOON_COLUMNS = (
    Column("Platoon", "platoon"),
    Column("smallest gap", "smallest_gap_m", "{:.2f} m"),
    Column("largest gap", "largest_gap_m", "{:.1f} m"),
    Column("gaps settled", "settled_s", "{:.0f} s"),
    Column("all stopped", "stopped_s", "{:.0f} s"),
    Column("slowest", "slowest_mps", "{:.1f} m/s"),
    Column("leader's top speed", "top_speed_mps", "{:.1f} m/s"),
)
STRING_COLUMNS = (
    Column("Platoons", "num_platoons"),
    Column("rear vehicle stands", "rear_stopped_s", "{:.0f} s"),
    Column("recovered", _recovered),
    Column("paper", "paper_min", "{:g} min"),
)
STRING_NOTE = (
    f"{RECOVERY_RULE} The linear gain from rear vehicle to rear vehicle exceeds one "
    "(`cps-envs reproduce string-stability`): disturbances grow from platoon to platoon, so that a long string need "
    "not settle."
)
OTHER_COLUMNS = (
    Column("tau", "tau_s", "{:g} s"),
    Column("stop once", lambda row: row.stops[0], "{:.0f} %"),
    Column("twice", lambda row: row.stops[1], "{:.0f} %"),
    Column("three times", lambda row: row.stops[2], "{:.0f} %"),
    Column("collided", "collided", "{:.0f} %"),
    Column("as rear vehicle", "rear_collided", "{:.0f} %"),
)
PAPER_SHARES = ("paper", "65 %", "45 %", "37.5 %", "55 %", "")
OTHER_NOTE = (
    "Shares of the 100 vehicles never disbanded, which stop at least so often. The paper speaks of platoons; 37.5 % is "
    "no whole number of 10 platoons or 100 vehicles, so that its count must be another one."
)
