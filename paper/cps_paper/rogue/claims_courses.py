"""The claims about courses at equal power and about the attacker: R01 to R07, R17, R19 and R21."""

from __future__ import annotations

from itertools import product

import numpy as np

from cps_envs.core.declare.config import bounds
from cps_envs.core.types import FloatArray
from cps_paper.claims import Claim, Finding, applying, joined
from cps_paper.rogue.claims import CLAIMS, FAR_LESS
from cps_paper.rogue.course import RogueCourse
from cps_paper.rogue.experiments import RogueEvidence, searched_ride, swaying_ride
from cps_paper.rogue.heat_map import COURSE_FREQUENCIES_HZ, DISBANDING, FREQUENCIES_HZ, RATIOS, SWAYS
from cps_paper.rogue.rides import closing_speeds_mps, gap_errors_m
from cps_paper.verdicts import (
    NEAR_SHARE,
    SAME_SHARE,
    above,
    deviation,
    grows_throughout,
    of_recovery,
    recovery_s,
)

QUARTERS, LEAST_GROWTH = 4, 0.01  # of the time; share of the final damage that counts as growth
GIVEN_UP_SEPARATIONS = 10  # behind the reference, from where on it counts as given up
SAME_SPEED_MPS = 1.0
FULL_SHARE = 0.9  # of the strongest braking there is, from where on it counts as full
SOON_S = 1.0  # after the disbanding
ENDS = (RATIOS[0], RATIOS[-1])
EARLY_DISBANDING = ("disband_2", "disband_4")
AT = f"at {joined(COURSE_FREQUENCIES_HZ, 'g')} Hz"


def courses(evidence: RogueEvidence, defender: str, *, human_returns: bool = False) -> list[RogueCourse]:
    """One per frequency."""
    return [evidence.course(defender, each, human_returns=human_returns) for each in COURSE_FREQUENCIES_HZ]


@CLAIMS.judges("R02")
def damage_grows(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Whether damage grows in every quarter of the time."""
    rides = courses(evidence, "sliding")
    hold = [ride.grows_throughout(QUARTERS, LEAST_GROWTH) for ride in rides]
    early = [float(ride.damage[ride.at(ride.config.duration_s / QUARTERS)]) for ride in rides]
    shown = f"D after 25 s {joined(early, '.1f')}, at the end {_finals(rides)} {AT}"
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("R03")
def detection_helps(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Damage with and without detection."""
    without, with_it = courses(evidence, "sliding"), courses(evidence, "sliding_detection")
    hold = [b.final_damage < FAR_LESS * a.final_damage for a, b in zip(without, with_it, strict=True)]
    return Finding.of_cases(hold, f"{_finals(without)} becomes {_finals(with_it)} {AT}")


@CLAIMS.judges("R04")
def leader_leaves_its_reference(evidence: RogueEvidence, claim: Claim) -> Finding:
    """How far the leader is behind the reference at the end."""
    rides = courses(evidence, "sliding_detection")
    behind = [float(ride.behind_m[-1, -1]) for ride in rides]
    hold = [each > GIVEN_UP_SEPARATIONS * ride.config.separation_m for each, ride in zip(behind, rides, strict=True)]
    return Finding.of_cases(hold, f"leader {joined(behind)} m behind at the end {AT}")


@CLAIMS.judges("R05")
def all_follow_the_attacker(evidence: RogueEvidence, claim: Claim) -> Finding:
    """How far the intact vehicles' speeds are from the attacker's over the last tenth of the time."""
    rides = courses(evidence, "sliding_detection")
    apart = []
    for ride in rides:
        last = ride.speed_mps[-len(ride.time_s) // 10 :]
        apart.append(float(np.abs(last[:, ride.intact] - last[:, [ride.attacker]]).mean(axis=0).max()))
    hold = [each < SAME_SPEED_MPS for each in apart]
    return Finding.of_cases(hold, f"speeds within {joined(apart, '.2f')} m/s of the attacker's {AT}")


@CLAIMS.judges("R06")
def disbanding_helps_further(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Damage with detection, and with disbanding at +2 m."""
    before, after = courses(evidence, "sliding_detection"), courses(evidence, "disband_2")
    larger, smaller = ([ride.final_damage for ride in rides] for rides in (before, after))
    return Finding.of_comparisons(larger, smaller, f"{_finals(before)} becomes {_finals(after)} {AT}")


@CLAIMS.judges("R07")
def front_vehicles_recover(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Speeds of the vehicles ahead of the attacker, and the leader's place, beside those without the attack."""
    calm = evidence.calm("disband_2")
    rides, returning = (courses(evidence, "disband_2", human_returns=returns) for returns in (False, True))
    speeds = [_speed_deviations(ride, calm) for ride in rides]
    places = [_place_deviations(ride, calm) for ride in rides]
    same, near = ([bool(each[-1] <= share) for each in (*speeds, *places)] for share in (SAME_SHARE, NEAR_SHARE))
    times = (recovery_s(calm.time_s, each) for each in speeds)
    after = " / ".join("-" if time_s is None else f"{time_s:.0f}" for time_s in times)
    back = sum(bool(_place_deviations(ride, calm)[-1] <= SAME_SHARE) for ride in returning)
    shown = (
        f"speed within {SAME_SHARE:.0%} at {sum(same[: len(rides)])} of {len(rides)} frequencies, after {after} s; the "
        f"leader's place within {SAME_SHARE:.0%} of sigma at {sum(same[len(rides) :])} "
        f"({joined([float(ride.behind_m[-1, -1]) for ride in rides])} m behind), at {back} if a human leader returns"
    )
    return Finding(all(same), shown, of_recovery(same, near))


@CLAIMS.judges("R19")
def sudden_braking(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Where disbanding raises the damage: do vehicles brake at full effort at once, and does most damage follow?"""
    hold, shown, cells = [], [], list(product(EARLY_DISBANDING, ENDS))
    for defender, ratio in cells:
        ride = evidence.course(defender, FREQUENCIES_HZ[0], ratio)
        alone = float(evidence.map("sliding_detection").row(ratio)[0])
        if ride.disbanded_s is None or not above(ride.final_damage, alone):
            shown.append(f"{defender}, ratio {ratio:g}: no higher")
            continue
        then = ride.at(ride.disbanded_s)
        braking = float(ride.acceleration_mps2[then : ride.at(ride.disbanded_s + SOON_S) + 1, ride.intact].min())
        hardest = bounds(ride.config.drive_mps2)[0] * ride.config.min_effort
        hold.append(braking <= FULL_SHARE * hardest and ride.damage[then] < 0.5 * ride.final_damage)
        shown.append(
            f"{defender}, ratio {ratio:g}: {ride.damage[then]:.1f} of {ride.final_damage:.0f} before the disbanding at "
            f"{ride.disbanded_s:.1f} s, then braking at {-braking:.1f} m/s2"
        )
    looked = f"{FREQUENCIES_HZ[0]:g} Hz, the only frequency looked at, {applying(len(hold), len(cells), 'cells')}"
    return Finding.of_cases(hold or [False], f"{looked}: {'; '.join(shown)}")


def _finals(rides: list[RogueCourse]) -> str:
    return joined([ride.final_damage for ride in rides], ".1f")


def _speed_deviations(ride: RogueCourse, calm: RogueCourse) -> FloatArray:
    ahead = slice(ride.attacker + 1, None)
    wanted = float(ride.config.reference_speed_mps)  # type: ignore[arg-type]
    return deviation(ride.speed_mps[:, ahead], calm.speed_mps[:, ahead], wanted)


def _place_deviations(ride: RogueCourse, calm: RogueCourse) -> FloatArray:
    return deviation(ride.behind_m[:, -1:], calm.behind_m[:, -1:], ride.config.separation_m)


BETTER = 1.1  # times full throttle, from where on a square wave counts as better
HARMLESS_SHARE = 0.05  # of the damage, that may come after the disbanding


HIGH_MPS = 5.0  # closing speed, from where on a crash counts as one at high speed; chosen


@CLAIMS.judges("R01")
def sways_and_crashes(evidence: RogueEvidence, claim: Claim) -> Finding:
    """With gains of our choice: do gap errors grow through the run, and is there a crash at high speed?"""
    rides = [evidence[swaying_ride(*each)] for each in SWAYS[1:]]
    errors = [gap_errors_m(ride) for ride in rides]
    fastest = [max(closing_speeds_mps(ride), default=0.0) for ride in rides]
    hold = [grows_throughout(largest) and speed >= HIGH_MPS for largest, speed in zip(errors, fastest, strict=True)]
    shown = "; ".join(
        f"ratio {ratio:g}: largest gap errors {joined(largest)} m in thirds, crash at {speed:.1f} m/s"
        for (_, ratio), largest, speed in zip(SWAYS[1:], errors, fastest, strict=True)
    )
    return Finding.of_cases(hold, f"{shown}; the paper prints no gains, these are ours")


@CLAIMS.judges("R17")
def no_more_influence(evidence: RogueEvidence, claim: Claim) -> Finding:
    """Who drives faster than a square wave at the end, and what a searched attacker does after the disbanding."""
    rides = courses(evidence, "disband_7")
    ahead = [_free(ride, slice(ride.attacker + 1, None)) for ride in rides]
    behind = [_free(ride, slice(0, ride.attacker)) for ride in rides]
    hold, late = [all(ahead), all(behind)], []
    for defender in DISBANDING:
        ride = evidence[searched_ride(defender, evidence.contact)]
        before = 0.0 if ride.disbanded_s is None else float(ride.damage[ride.at(ride.disbanded_s)])
        hold.append(ride.final_damage - before <= HARMLESS_SHARE * ride.final_damage)
        late.append(f"{ride.final_damage - before:.1f} of {ride.final_damage:.1f}")
    shown = (
        f"square wave, +7 m: 4 and 5 get away at {sum(ahead)} of {len(rides)} frequencies, 1 and 2 at {sum(behind)}; "
        f"searched attacker, equal power: D after the disbanding {', '.join(late)} (+2, +4, +7 m)"
    )
    return Finding.of_cases(hold, shown)


@CLAIMS.judges("R21")
def oscillation_is_better(evidence: RogueEvidence, claim: Claim) -> Finding:
    """The best square wave against full throttle, equal power, 60 s."""
    found = {defender: evidence.steady(defender) for defender in ("pd", "sliding", "sliding_detection")}
    hold = [best > BETTER * throttle for best, throttle in found.values()]
    shown = ", ".join(f"{best:.1f} against {throttle:.1f} ({name})" for name, (best, throttle) in found.items())
    return Finding.of_cases(hold, f"best square wave against full throttle, equal power, 60 s: {shown}")


def _free(ride: RogueCourse, vehicles: slice) -> bool:
    """Whether these vehicles are faster than the attacker over the last tenth of the time."""
    last = ride.speed_mps[-len(ride.time_s) // 10 :].mean(axis=0)
    return bool(np.all(last[vehicles] > last[ride.attacker] + SAME_SPEED_MPS))
