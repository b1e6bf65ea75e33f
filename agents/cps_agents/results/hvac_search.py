"""What the HVAC policies found by policy search have to reach: means, worst attacks, three liars."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from cps_agents.arena.challenge import Challenge
from cps_agents.results.block import Bar, Block, Row
from cps_baselines.arena import Contestant, Venue
from cps_baselines.hvac.contest import ATTACKERS

DEFENDER = Contestant("searched", "zoo:hvac-defense-cma", "searched, weighs sets of liars")
NOT_CALIBRATED = {"mtd2_calibrated": "has no threshold for the preset `learning`"}
DAYS = 20
THREE: Mapping[str, Any] = {"compromised_weights": (), "num_compromised": 3}
HIDDEN = ("tracker", "tracker_warm", "noisy_ramp", "noisy_ramp_warm", "noisy_mimic", "noisy_mimic_warm")
LOUD = ("constant", "brink", "noisy_shaped", "noisy_root", "listener", "listener_warm")


def _challenges(attackers: Iterable[Contestant], overrides: Mapping[str, Any]) -> tuple[Challenge, ...]:
    venue = Venue("hvac", "learning", overrides)
    return tuple(Challenge(venue, "defender", each.reference, DAYS) for each in attackers)


def _named(*names: str) -> tuple[Contestant, ...]:
    return tuple(each for each in ATTACKERS.policies if each.name in names)


def _at_most(value: float) -> Bar:
    return Bar(value=value, or_equal=True, by_mean=True)


DEFENSE = Block(
    name="hvac-defense-searched",
    title="HVAC defender by policy search, A_impact on days whose heat drifts",
    target="below every analytic defender in the mean over all attacks, at most 9 C2; at most 16 C2 against each "
    "attack that hides; at most 15 C2 in the mean where three of four sensors lie.",
    problem="hvac",
    role="defender",
    metric="a_impact",
    learned=(DEFENDER,),
    baselines=(Contestant("informed", optimum=True),),
    rows=(
        Row(
            "mean over all attacks of the contest",
            _challenges(ATTACKERS.policies, {}),
            (Bar(every=True), _at_most(9.0)),
            headline=True,
        ),
        Row("three liars, mean of twelve attacks", _challenges(_named(*HIDDEN, *LOUD), THREE), None),
        *(
            Row(each.title or each.name.replace("_", " "), _challenges([each], {}), (_at_most(16.0),))
            for each in _named(*HIDDEN)
        ),
    ),
    bars=(Bar(every=True), _at_most(15.0)),
    unit="C2",
    shown=("flawed_steps",),
    notes=(
        "A fifth of the days has no liar, and the numbers of liars are drawn as the preset says. A few days with three "
        "liars carry the means.",
        "`informed` is told who lies and follows the filter of all others.",
    ),
    left_out=NOT_CALIBRATED,
)
BLOCKS = (DEFENSE,)
