"""The claims about the attacker: R01, R17 and R21."""

from __future__ import annotations

import numpy as np

from cps_baselines.reproduction.claims import Claim, Finding
from cps_baselines.reproduction.verdicts import UNKNOWN, of_cases
from cps_baselines.rogue.reproduction.claims import CLAIMS
from cps_baselines.rogue.reproduction.claims_courses import SAME_SPEED_MPS, courses
from cps_baselines.rogue.reproduction.course import Course
from cps_baselines.rogue.reproduction.evidence import Evidence, searched_ride
from cps_baselines.rogue.reproduction.settings import DISBANDING

BETTER = 1.1  # times full throttle, from where on a square wave counts as better
HARMLESS_SHARE = 0.05  # of the damage, that may come after the disbanding


@CLAIMS.judges("R01")
def earlier_work(evidence: Evidence, claim: Claim) -> Finding:
    """Fig. 5.2 is from earlier work with another platoon."""
    shown = "cannot be checked: the gains of the earlier work are not in the text; part 5.2 takes gains of our choice"
    return Finding(None, shown, UNKNOWN)


@CLAIMS.judges("R17")
def no_more_influence(evidence: Evidence, claim: Claim) -> Finding:
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
    return Finding(all(hold), shown, of_cases(hold))


@CLAIMS.judges("R21")
def oscillation_is_better(evidence: Evidence, claim: Claim) -> Finding:
    """The best square wave against full throttle, equal power, 60 s."""
    found = {defender: evidence.steady(defender) for defender in ("pd", "sliding", "sliding_detection")}
    hold = [best > BETTER * throttle for best, throttle in found.values()]
    shown = ", ".join(f"{best:.1f} against {throttle:.1f} ({name})" for name, (best, throttle) in found.items())
    return Finding(all(hold), f"best square wave against full throttle, equal power, 60 s: {shown}", of_cases(hold))


def _free(ride: Course, vehicles: slice) -> bool:
    """Whether these vehicles are faster than the attacker over the last tenth of the time."""
    last = ride.speed_mps[-len(ride.time_s) // 10 :].mean(axis=0)
    return bool(np.all(last[vehicles] > last[ride.attacker] + SAME_SPEED_MPS))
