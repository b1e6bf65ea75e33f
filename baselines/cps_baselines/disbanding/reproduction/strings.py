"""Fig. 2.1 in numbers: courses of platoons, recovery of strings, stops and collisions under many attacks."""

from __future__ import annotations

from dataclasses import dataclass

from cps_baselines.disbanding.reproduction.claims import CLAIMS
from cps_baselines.disbanding.reproduction.claims_2_1 import NEARLY_STOPPED_MPS
from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.disbanding.reproduction.experiments import STRINGS, TAUS_S
from cps_baselines.disbanding.reproduction.recording import Record
from cps_baselines.reproduction.evidence import NotRunError
from cps_envs.disbanding.dynamics import STOP_MPS

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


def courses(evidence: Evidence) -> tuple[list[PlatoonCourse], list[StringCourse], list[EveryOther]]:
    """Figs. 2.1a-c, d and e, as far as they were simulated."""
    printed = {claim.id: claim.number for claim in CLAIMS.printed() if claim.id in RECOVERY_CLAIMS}
    twenty = evidence[evidence.experiments.string(STRINGS[0])]
    strings = []
    for count, claim in zip(STRINGS, RECOVERY_CLAIMS, strict=True):
        try:
            strings.append(_string(evidence[evidence.experiments.string(count)], printed[claim]))
        except NotRunError:
            continue
    others = [_every_other(evidence, tau_s) for tau_s in TAUS_S[:2]]
    return [_platoon(twenty, platoon) for platoon in SHOWN], strings, others


def _platoon(record: Record, platoon: int) -> PlatoonCourse:
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


def _string(record: Record, paper_min: float) -> StringCourse:
    recovered = record.recovered_s()
    return StringCourse(
        num_platoons=record.config.max_platoons,
        rear_stopped_s=record.duration_s(record.speed_mps[:, -1] < STOP_MPS),
        recovered_min=None if recovered is None else recovered / 60.0,
        duration_min=float(record.time_s[-1]) / 60.0,
        paper_min=paper_min,
    )


def _every_other(evidence: Evidence, tau_s: float) -> EveryOther:
    outcome = evidence[evidence.experiments.every_other(tau_s)].outcome
    once, twice, thrice = (outcome.stopped_share(times) for times in (1, 2, 3))
    rear = 100.0 * float(outcome.rear_collided[outcome.intact].mean())
    return EveryOther(tau_s, (once, twice, thrice), outcome.collided_share(), rear)
