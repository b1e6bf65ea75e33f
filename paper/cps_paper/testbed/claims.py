"""The claims of section 2.5, T01 to T13, and the functions that check them over all seeds."""

from __future__ import annotations

import numpy as np

from cps_envs.core.types import BoolArray, FloatArray
from cps_paper.claims import Claim, Claims, Finding, joined
from cps_paper.evidence import NotRunError
from cps_paper.testbed.cases import BASE, CASES, LONG, LONG_S, MITIGATED_CASES, SHORT, Results
from cps_paper.testbed.robots.config import BASELINE
from cps_paper.verdicts import (
    COMPARISON_RULE,
    NEAR_SHARE,
    RECOVERY_RULE,
    REPRODUCED,
    SAME_SHARE,
    above,
    of_cases,
    of_number,
    of_recovery,
)

CLAIMS: Claims[Results] = Claims("claims_testbed")
RULES = (
    "Rules. The paper has one run of each case, we have one for each seed. A velocity error: the mean over the seeds, "
    f"reproduced within {100 * SAME_SHARE:g} % of the paper's, near within {100 * NEAR_SHARE:g} %. Events that "
    "the paper saw, events that never happen, and comparisons of two cases under the same seed: reproduced if so in "
    "all runs, near in all but one, partly in some. A relative reduction: reproduced within 5 % of the paper's. "
    + COMPARISON_RULE
    + RECOVERY_RULE
)


@CLAIMS.judges("T01", "T02", "T03")
def velocity_error(results: Results, claim: Claim) -> Finding:
    """E_v of a case: mean, standard deviation and range over the seeds."""
    (case,) = (case for case in CASES if case.claim == claim.id)
    errors = results.errors(case)
    mean = float(errors.mean())
    shown = f"{mean:.1f} ± {deviation(errors):.1f} %, {errors.min():.1f} to {errors.max():.1f}"
    return Finding.of_number(mean, claim, shown)


def deviation(values: FloatArray) -> float:
    """Standard deviation of a sample; 0 of a single value."""
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


@CLAIMS.judges("T04")
def baseline_stops(results: Results, claim: Claim) -> Finding:
    """Seeds in which the baseline brings an intact robot to a stop."""
    stopped = results.of(BASE).metrics["stopped"]
    shown = f"in {np.sum(stopped >= 1)} of {len(stopped)} seeds; {stopped.mean():.1f} robots on average"
    return Finding.of_cases((stopped >= 1).tolist(), shown)


@CLAIMS.judges("T05", "T06")
def mitigated_stops(results: Results, claim: Claim) -> Finding:
    """Intact robots that stop with the mitigation."""
    metrics = results.of(SHORT if claim.id == "T05" else LONG).metrics
    shown = f"{metrics['stopped'].sum():.0f} in all seeds; slowest {100 * metrics['lowest_speed_mps'].min():.1f} cm/s"
    return Finding(float(metrics["stopped"].mean()), shown, of_cases((metrics["stopped"] == 0).tolist()))


@CLAIMS.judges("T07", "T08")
def collisions(results: Results, claim: Claim) -> Finding:
    """Robots nearer than a body's length to the one ahead."""
    cases = (BASE,) if claim.id == "T07" else (SHORT, LONG)
    collided = np.concatenate([results.of(case).metrics["collided"] for case in cases])
    narrowest = min(float(results.of(case).metrics["smallest_gap_m"].min()) for case in cases)
    shown = f"{collided.sum():.0f} in all seeds; smallest gap {narrowest:.3f} m of {BASELINE.body_length_m:.2f} m"
    return Finding(float(collided.mean()), shown, of_cases((collided == 0).tolist()))


@CLAIMS.judges("T09")
def closer(results: Results, claim: Claim) -> Finding:
    """Smallest gaps of both mitigations under the same seed."""
    short, long = (results.of(case).metrics["smallest_gap_m"] for case in (SHORT, LONG))
    shown = f"{long.mean():.3f} m against {short.mean():.3f} m; in {_count(long < short)} seeds"
    return Finding.of_comparisons(short.tolist(), long.tolist(), shown)


@CLAIMS.judges("T10")
def falls(results: Results, claim: Claim) -> Finding:
    """E_v of both mitigations under the same seed."""
    change = results.errors(LONG) - results.errors(SHORT)
    shown = (
        f"by {-change.mean():.2f} ± {deviation(change):.2f} points under the same seed; in {_count(change < 0)} seeds"
    )
    return Finding.of_comparisons(results.errors(SHORT).tolist(), results.errors(LONG).tolist(), shown)


@CLAIMS.judges("T11")
def smoother(results: Results, claim: Claim) -> Finding:
    """Root mean square of the accelerations, against the baseline under the same seed."""
    base, *mitigated = (results.of(case).metrics["rms_acceleration_mps2"] for case in CASES)
    rougher, smoother = np.tile(base, len(mitigated)), np.concatenate(mitigated)
    hold = np.array([above(*pair) for pair in zip(rougher, smoother, strict=True)])
    changes = joined([100.0 * (float(values.mean() / base.mean()) - 1.0) for values in mitigated])
    shown = f"rms acceleration {changes} % at t_s = 0.5 / 1 s; in {_count(hold)} runs"
    return Finding.of_comparisons(rougher.tolist(), smoother.tolist(), shown)


@CLAIMS.judges("T12")
def gains(results: Results, claim: Claim) -> Finding:
    """Relative reduction of the mean E_v."""
    ours = results.gains()
    hold = [of_number(value, paper) == REPRODUCED for value, paper in zip(ours, claim.numbers, strict=True)]
    right = all(value > 0 for value in ours)
    return Finding(ours, f"{joined(ours, '.1f')} %{': the direction only' if right else ''}", of_cases(hold))


@CLAIMS.judges("T13")
def recovers(results: Results, claim: Claim) -> Finding:
    """Speeds and gaps of the intact robots at the end of the usual runs; how long it takes, in long ones."""
    ends = [results.recovery(case) for case in MITIGATED_CASES]
    same, near = (np.concatenate([end.recovered(share) for end in ends]) for share in (SAME_SHARE, NEAR_SHARE))
    speeds = np.concatenate([end.speed_deviation[:, -1] for end in ends])
    gaps = np.concatenate([end.gap_deviation[:, -1] for end in ends])
    shown = (
        f"at the end speeds and gaps are within {SAME_SHARE:.0%} in {_count(same)} runs, within {NEAR_SHARE:.0%} in "
        f"{_count(near)} (speeds {np.sum(speeds <= NEAR_SHARE)}, gaps {np.sum(gaps <= NEAR_SHARE)})"
    )
    verdict = of_recovery(same.tolist(), near.tolist())
    return Finding(bool(same.all()), f"{shown}{_recovery_times(results)}", verdict)


def _recovery_times(results: Results) -> str:
    try:
        times = [results.recovery(case, LONG_S).times_s(NEAR_SHARE) for case in MITIGATED_CASES]
    except NotRunError:
        return ""
    found = [time_s for each in times for time_s in each]
    after = f", after {np.median(found):.0f} s (median)" if found else ""
    return f"; in {LONG_S:g} s within {NEAR_SHARE:.0%} in {len(found)}{after}"


def _count(hold: BoolArray) -> str:
    return f"{np.sum(hold)} of {len(hold)}"
