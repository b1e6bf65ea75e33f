"""Fig. 2.1 in numbers: courses of platoons, recovery of strings, stops and collisions under many attacks."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, dataclass

from cps_envs.disbanding.dynamics import STOP_MPS
from cps_paper.disbanding.claims_2_1 import NEARLY_STOPPED_MPS
from cps_paper.disbanding.experiments import STRINGS, TAUS_S, DisbandingEvidence
from cps_paper.disbanding.rules import CLAIMS
from cps_paper.disbanding.scenario import ScenarioCourse
from cps_paper.evidence import NotRunError
from cps_paper.exhibit import Column, ExhibitTable
from cps_paper.verdicts import RECOVERY_RULE

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
    f"{RECOVERY_RULE} The linear gain from rear vehicle to rear vehicle exceeds one (part 2.2.1): disturbances "
    "grow from platoon to platoon, so that a long string need not settle."
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
