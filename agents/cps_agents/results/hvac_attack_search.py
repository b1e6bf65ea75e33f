"""What the HVAC attackers found by policy search have to reach: the learned defender, and MTD2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_agents.arena.challenge import Challenge
from cps_agents.results.block import Bar, Block, Row
from cps_baselines.arena import Contestant, Venue
from cps_baselines.hvac.contest import ATTACKERS

TRACKER = Contestant("searched", "zoo:hvac-attack-cma", "searched, hides in the drift")
BRINK = Contestant("searched", "zoo:hvac-attack-mtd2-cma", "searched, at the threshold")
DAYS, MTD2_DAYS = 200, 20
FILTERS: Mapping[str, Any] = {"kalman_filters": True}  # shows more to those that need it and changes nothing else
AIMS = {2: 42.0, 3: 140.0}  # C2 against MTD2; with one sensor nothing better than `brink` is known
HIDDEN_CHOICE = {"opportunist": "judges a defender by its choices, which `learning` hides from the attacker"}


def _liars(count: int) -> Mapping[str, Any]:
    return {"compromised_weights": (), "num_compromised": count} if count else {}


def _drifting(title: str, count: int, *, headline: bool = False) -> Row:
    venue = Venue("hvac", "learning", _liars(count))
    return Row(title, (Challenge(venue, "attacker", "zoo:hvac-defense-cma", DAYS),), headline=headline)


def _checked(count: int) -> Row:
    venue = Venue("hvac", "paper", {"num_compromised": count})
    aim = (Bar(value=AIMS[count], or_equal=True, by_mean=True),) if count in AIMS else ()
    challenge = Challenge(venue, "attacker", "mtd2", MTD2_DAYS)
    return Row(f"mtd2, {count} of 4 sensors", (challenge,), (Bar(every=True), *aim), headline=count == max(AIMS))


LEARNED = Block(
    name="hvac-attack-searched",
    title="HVAC attacker by policy search against the learned defender, A_impact",
    target="above every analytic attacker against `zoo:hvac-defense-cma`, on days whose heat drifts.",
    problem="hvac",
    role="attacker",
    metric="a_impact",
    learned=(TRACKER,),
    baselines=tuple(each for each in ATTACKERS.policies if each.policy),
    rows=(
        _drifting("all days", 0, headline=True),
        *(_drifting(f"{count} of 4 sensors lie", count) for count in (1, 2, 3)),
    ),
    bars=(Bar(every=True),),
    unit="C2",
    shown=("flawed_steps",),
    notes=(
        "Of all days a fifth has no liar, and the numbers of liars are drawn as the preset says.",
        "A fresh search against the defender, so this is also how far it can be exploited.",
    ),
    left_out=HIDDEN_CHOICE,
)
MTD2 = Block(
    name="hvac-attack-mtd2-searched",
    title="HVAC attacker by policy search against MTD2, A_impact",
    target="above every analytic attacker against MTD2; at least 42 and 140 C2 with 2 and 3 of 4 sensors.",
    problem="hvac",
    role="attacker",
    metric="a_impact",
    learned=(BRINK,),
    baselines=(
        Contestant("brink 0", "brink?margin_c2=0", "brink, no margin"),
        Contestant("ramp 0.7", "ramp?rate_c_per_h=0.7", "ramp 0.7 C/h"),
        *(Contestant(name, overrides=FILTERS) for name in ("listener", "tracker")),
    ),
    rows=tuple(map(_checked, (1, 2, 3))),
    unit="C2",
    shown=("flawed_steps",),
    notes=("`brink` with no margin is the attack that the search starts from.",),
)
BLOCKS = (LEARNED, MTD2)
