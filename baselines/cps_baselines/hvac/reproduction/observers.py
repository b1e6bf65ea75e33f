"""Fig. 4.5: how far the observer is off with few sensors and short windows, and the claims C15 to C23 about it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from cps_baselines.hvac.reproduction.controllers import Evidence
from cps_baselines.hvac.reproduction.experiments import FIGURE_4_5_DAYS, OBSERVERS, Case, observed
from cps_baselines.hvac.reproduction.rules import CLAIMS, of_printed, of_range
from cps_baselines.reproduction.claims import Claim, Finding, joined
from cps_baselines.reproduction.exhibit import Column, Table
from cps_baselines.reproduction.verdicts import of_cases
from cps_envs.core.types import FloatArray

LONG, SHORT, TWO, THREE = OBSERVERS
LARGEST = {"C15": (LONG, 1), "C16": (LONG, 3), "C17": (LONG, 4), "C19": (SHORT, 1), "C20": (SHORT, 3)}  # case, zone
START = {"C18": LONG, "C21": SHORT}
ALIKE = {"C22": TWO, "C23": THREE}


def largest_errors_c(evidence: Evidence, case: Case) -> FloatArray:
    """The largest |xh - x| of each day and zone (B, n), C, once the window is full."""
    course = evidence[observed(*case)]
    largest: FloatArray = course.estimation_error_c[course.config.window_steps :].max(axis=0)
    return largest


def start_h(evidence: Evidence, case: Case) -> float:
    """When the estimation starts, h."""
    config = evidence[observed(*case)].config
    return config.window_steps * config.step_s / 3600.0


@CLAIMS.judges(*LARGEST)
def largest_error(evidence: Evidence, claim: Claim) -> Finding:
    """The largest estimation error of a zone; it differs from day to day by the noise."""
    case, zone = LARGEST[claim.id]
    days = largest_errors_c(evidence, case)[:, zone - 1]
    ours = float(np.median(days))
    shown = f"{ours:.3f} °C (median of {len(days)} days, {days.min():.2f} to {days.max():.2f})"
    return Finding(ours, shown, of_range(days, claim.number))


@CLAIMS.judges(*START)
def estimation_starts(evidence: Evidence, claim: Claim) -> Finding:
    """When the window is full, by construction."""
    ours = start_h(evidence, START[claim.id])
    return Finding(ours, f"{ours:.2f} h", of_printed(ours, claim))


@CLAIMS.judges(*ALIKE)
def zones_alike(evidence: Evidence, claim: Claim) -> Finding:
    """Whether every zone's estimate is as good as a measurement: never off by more than one standard deviation."""
    case = ALIKE[claim.id]
    limit_c = evidence[observed(*case)].config.noise_std_c
    largest = np.median(largest_errors_c(evidence, case), axis=0)
    hold = [bool(error <= limit_c) for error in largest]
    shown = f"largest {joined(largest.tolist(), '.2f')} °C in zones 1 to 4; a reading is off by {limit_c:.2f} °C"
    return Finding(all(hold), shown, of_cases(hold))


def observers_table(evidence: Evidence) -> Table:
    """Fig. 4.5 in numbers."""
    papers = {place: CLAIMS.number(name) for name, place in LARGEST.items()}

    def errors(zone: int) -> Callable[[Case], str]:
        def shown(case: Case) -> str:
            days = largest_errors_c(evidence, case)[:, zone - 1]
            paper = f"\npaper {papers[case, zone]:g}" if (case, zone) in papers else ""
            return f"{np.median(days):.2f} ({days.min():.2f}-{days.max():.2f}){paper}"

        return shown

    columns = (
        Column("sensors", lambda case: ", ".join(f"s{sensor}" for sensor in case[0])),
        Column("N_e", lambda case: case[1]),
        Column("starts", lambda case: evidence[observed(*case)].time_h[case[1]], "{:.2f} h"),
        *(Column(f"zone {zone}", errors(zone)) for zone in range(1, 5)),
    )
    note = f"Largest estimation error in °C: median (range) over {FIGURE_4_5_DAYS} days; paper: where it gives one."
    title = "Fig. 4.5: the observer with few sensors"
    return Table(title, columns, OBSERVERS, (note,), data=lambda case: _data(evidence, case))


def _data(evidence: Evidence, case: Case) -> dict[str, Any]:
    largest = largest_errors_c(evidence, case)
    return {
        "sensors": case[0],
        "window_steps": case[1],
        "start_h": start_h(evidence, case),
        "largest_error_c": {
            "median": np.median(largest, axis=0).tolist(),
            "lowest": largest.min(axis=0).tolist(),
            "highest": largest.max(axis=0).tolist(),
        },
    }
