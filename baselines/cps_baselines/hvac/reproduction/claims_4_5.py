"""The claims of section 4.5.1 about the observer: C15 to C23."""

from __future__ import annotations

import numpy as np

from cps_baselines.hvac.reproduction.claims import CLAIMS
from cps_baselines.hvac.reproduction.estimation_errors import largest_errors_c, start_h
from cps_baselines.hvac.reproduction.experiments import OBSERVERS, observed
from cps_baselines.hvac.reproduction.rules import of_printed, of_range
from cps_baselines.reproduction.claims import Claim, Finding, joined
from cps_baselines.reproduction.evidence import Evidence
from cps_baselines.reproduction.verdicts import of_cases

LONG, SHORT, TWO, THREE = OBSERVERS
LARGEST = {"C15": (LONG, 1), "C16": (LONG, 3), "C17": (LONG, 4), "C19": (SHORT, 1), "C20": (SHORT, 3)}  # case, zone
START = {"C18": LONG, "C21": SHORT}
ALIKE = {"C22": TWO, "C23": THREE}


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
