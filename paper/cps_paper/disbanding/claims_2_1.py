"""The claims about Fig. 2.1: one disbanded platoon ahead of 19 (P01 to P16), ten of twenty disbanded (P17 to P20)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cps_envs.core.declare.config import bounds
from cps_envs.disbanding.dynamics import STOP_MPS
from cps_paper.claims import Claim, Finding, joined
from cps_paper.disbanding.experiments import ATTACK_S, STRINGS, TAUS_S, DisbandingEvidence
from cps_paper.disbanding.rules import CLAIMS
from cps_paper.disbanding.scenario import ScenarioCourse
from cps_paper.verdicts import (
    NEAR_SHARE,
    SAME_SHARE,
    above,
    by_construction,
    of_cases,
    of_number,
    of_recovery_time,
)

LEAD, FIRST_INTACT, FIFTEENTH, TENTH, REAR = 20, 19, 15, 10, 1  # platoons in the legends
NEARLY_STOPPED_MPS = 0.5  # chosen, generous
CHANGE_SHARE = 0.05  # of the desired gap or speed; chosen: smaller moves are no "decrease" or "increase"


def _twenty(evidence: DisbandingEvidence) -> ScenarioCourse:
    return evidence[evidence.string(STRINGS[0])]


@CLAIMS.judges("P01")
def disbanded_share(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Vehicles of the disbanded platoon among all."""
    share = 100.0 * float(np.mean(~_twenty(evidence).intact))
    return Finding(share, f"{share:g} %, an input", by_construction(of_number(share, claim.number)))


@CLAIMS.judges("P02")
def gap_left(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The inner gaps of the lead platoon when it is disbanded, and where they go."""
    record = _twenty(evidence)
    gaps = record.inner_gaps(LEAD)
    left = float(gaps[np.searchsorted(record.time_s, ATTACK_S - 1e-9)].mean())
    shown = f"{left:.2f} m, an input, then {gaps[-1].min():.0f} m and more"
    return Finding(left, shown, by_construction(of_number(left, claim.number)))


@CLAIMS.judges("P03")
def no_accident(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """No collision within the disbanded platoon."""
    record = _twenty(evidence)
    collided = int(record.collided[record.vehicles(LEAD)].sum())
    smallest = float(record.inner_gaps(LEAD).min())
    return Finding.of_cases([collided == 0], f"{collided} collided, smallest gap {smallest:.2f} m")


@CLAIMS.judges("P04")
def slow_then_fast(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Each vehicle of the disbanded platoon loses speed and regains some of it later."""
    record = _twenty(evidence)
    speed = record.speed_mps[:, record.vehicles(LEAD)]
    change = CHANGE_SHARE * record.config.desired_speed_mps
    lowest = speed.min(axis=0)
    hold = ((speed[0] - lowest > change) & (speed[-1] - lowest > change)).tolist()
    shown = f"{sum(hold)} of {len(hold)} vehicles, lowest speed {lowest.min():.1f} m/s, the front one stays at 31 m/s"
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("P05", "P06")
def extreme_gap(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Smallest (P05) and largest (P06) inner gap of the first intact platoon."""
    gaps = _twenty(evidence).inner_gaps(FIRST_INTACT)
    value = float(gaps.min() if claim.id == "P05" else gaps.max())
    name = "smallest" if claim.id == "P05" else "largest"
    return Finding(value, f"{name} {value:.2f} m", of_cases([value > claim.number]))


@CLAIMS.judges("P07")
def gap_back(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """When its inner gaps are back."""
    record = _twenty(evidence)
    settled, nearly = record.settled_s(FIRST_INTACT), record.settled_s(FIRST_INTACT, NEAR_SHARE)
    shown = (
        f"{_seconds(settled)} within {_percent(SAME_SHARE)} of x_d, {_seconds(nearly)} within {_percent(NEAR_SHARE)}"
    )
    return Finding(settled, shown, of_recovery_time(settled, nearly, claim.number))


@CLAIMS.judges("P08")
def all_stopped(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """For how long all vehicles of the 15th platoon stand at once."""
    record = _twenty(evidence)
    durations = [
        record.duration_s(record.speed_mps[:, record.vehicles(platoon)].max(axis=1) < NEARLY_STOPPED_MPS)
        for platoon in (FIFTEENTH, TENTH)
    ]
    shown = f"all below {NEARLY_STOPPED_MPS:g} m/s for {durations[0]:.0f} s (10th platoon: {durations[1]:.0f} s)"
    return Finding.of_number(durations[0], claim, shown)


@CLAIMS.judges("P09")
def top_speed(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The highest speed of the leader of the 15th platoon."""
    record = _twenty(evidence)
    fastest = float(record.speed_mps[:, record.vehicles(FIFTEENTH).start].max())
    limit = record.config.max_speed_mps
    shown = f"{fastest:.1f} m/s; vehicles drive {limit:g} m/s at most"
    return Finding(fastest, shown, by_construction(of_number(fastest, claim.number)))


@CLAIMS.judges("P10")
def slowed_down(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """When that leader, after its highest speed, is back at the desired one."""
    record = _twenty(evidence)
    speed, desired = record.speed_mps[:, record.vehicles(FIFTEENTH).start], record.config.desired_speed_mps
    top = int(speed.argmax())
    back, braking = (
        float(record.time_s[top + int(np.argmax(speed[top:] <= limit))]) for limit in (desired, speed.max() - 0.1)
    )
    settled = _seconds(record.settled_s(FIFTEENTH))
    shown = f"{back:.0f} s at {desired:g} m/s; begins to brake at {braking:.0f} s, gaps settled at {settled}"
    return Finding.of_number(back, claim, shown)


@CLAIMS.judges("P11")
def gap_pattern(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The inner gaps of the 15th platoon decrease, increase, and settle at the desired one."""
    record = _twenty(evidence)
    last = float(record.inner_gaps(FIFTEENTH)[-1].mean())
    pattern = _decrease_increase_settle(record, FIFTEENTH)
    shown = f"settles at {last:.2f} m at {_seconds(record.settled_s(FIFTEENTH))}"
    return Finding(last, shown if pattern else "another pattern", of_cases([pattern]))


@CLAIMS.judges("P12")
def longer_upstream(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """The same pattern for the 10th and the last platoon, which need longer than the 15th."""
    record = _twenty(evidence)
    times = [record.settled_s(platoon) or np.inf for platoon in (FIFTEENTH, TENTH, REAR)]
    hold = [_decrease_increase_settle(record, platoon) for platoon in (TENTH, REAR)]
    hold += [above(later, earlier) for earlier, later in pairwise(times)]
    return Finding.of_cases(hold, f"15th / 10th / last settle at {joined(times)} s")


def _decrease_increase_settle(record: ScenarioCourse, platoon: int) -> bool:
    gaps, desired = record.inner_gaps(platoon), bounds(record.config.desired_gap_m)[0]
    low, high = desired * (1 - CHANGE_SHARE), desired * (1 + CHANGE_SHARE)
    lowest = gaps.argmin(axis=0)
    grows = [bool((gaps[k:, j] > high).any()) for j, k in enumerate(lowest)]
    return bool((gaps.min(axis=0) < low).all()) and all(grows) and record.settled_s(platoon) is not None


@CLAIMS.judges("P13", "P15", "P16")
def recovery(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """When strings of 20, 50 and 80 platoons have recovered, in minutes."""
    count = dict(zip(("P13", "P15", "P16"), STRINGS, strict=True))[claim.id]
    record = evidence[evidence.string(count)]
    recovered, nearly = (_minutes(record.recovered_s(share)) for share in (SAME_SHARE, NEAR_SHARE))
    never = f"never in {record.time_s[-1] / 60.0:.0f} min"
    times = (never if minutes is None else f"{minutes:.1f} min" for minutes in (recovered, nearly))
    shown = ", ".join(
        f"{time} within {_percent(share)}" for time, share in zip(times, (SAME_SHARE, NEAR_SHARE), strict=True)
    )
    return Finding(recovered, shown, of_recovery_time(recovered, nearly, claim.number))


@CLAIMS.judges("P14")
def longer_stop(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """How long the rear vehicle stands, over the number of platoons."""
    records = [evidence[evidence.string(count)] for count in STRINGS]
    stops = [record.duration_s(record.speed_mps[:, -1] < STOP_MPS) for record in records]
    shown = f"rear vehicle stands {joined(stops)} s for N = {joined(list(STRINGS))}"
    return Finding.of_comparisons(stops[1:], stops[:-1], shown)


@CLAIMS.judges("P17", "P18", "P19")
def stop_and_go(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Share of the intact vehicles that stop at least once, twice, three times; the verdict is that at tau 0.1 s."""
    times = ("P17", "P18", "P19").index(claim.id) + 1
    shares = [evidence[evidence.every_other(tau_s)].stopped_share(times) for tau_s in TAUS_S[:2]]
    return Finding.of_number(shares[0], claim, f"{shares[0]:.0f} % of the vehicles (tau 0.3 s: {shares[1]:.0f} %)")


@CLAIMS.judges("P20")
def collisions_everywhere(evidence: DisbandingEvidence, claim: Claim) -> Finding:
    """Share of the intact vehicles involved in collisions."""
    outcomes = [evidence[evidence.every_other(tau_s)] for tau_s in TAUS_S[:2]]
    shares = [outcome.collided_share() for outcome in outcomes]
    rear = 100.0 * float(outcomes[1].rear_collided[outcomes[1].intact].mean())
    shown = f"{shares[0]:.0f} % (tau 0.3 s: {shares[1]:.0f} %, as rear vehicles {rear:.0f} %)"
    return Finding.of_number(shares[0], claim, shown)


def _seconds(time_s: float | None) -> str:
    return "never" if time_s is None else f"{time_s:.0f} s"


def _minutes(time_s: float | None) -> float | None:
    return None if time_s is None else time_s / 60.0


def _percent(share: float) -> str:
    return f"{100 * share:g} %"
