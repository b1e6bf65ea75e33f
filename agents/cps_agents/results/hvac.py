"""What the trained policies of the HVAC problem have to reach: target 4, and what policy search found.

Of the searched ones: means, worst attacks, three liars; against the learned defender, and against MTD2.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from cps_agents.arena.challenge import Challenge
from cps_agents.results.block import Bar, Block, Row
from cps_baselines.arena import Contestant, Venue
from cps_baselines.hvac.calibrated import HARD
from cps_baselines.hvac.contest import ATTACKERS
from cps_envs.hvac.problem import EASY_ATTACKERS

ATTACKER = Contestant("learned", "zoo:hvac-attack-ppo", "learned on MTD2")
AGAINST_MTD1 = Contestant("learned-mtd1", "zoo:hvac-attack-mtd1-ppo", "learned on MTD1")
DEFENDER = Contestant("learned", "zoo:hvac-defense-ppo")
DAYS = 20  # where nothing else is said
MIXED_DAYS = 200  # of the preset `easy`
RATES_C_PER_H = (0.5, 0.6, 0.7, 0.8)
RAMPS = (
    *(Contestant(f"ramp {rate}", f"ramp?rate_c_per_h={rate}", f"ramp {rate} C/h") for rate in RATES_C_PER_H),
    Contestant("root_ramp"),
    Contestant("mimic"),
)
LOWEST = Contestant("lowest", "constant?reading_c=10", "lowest reading, 10 C")
FILTERS: Mapping[str, Any] = {"kalman_filters": True}  # shows more to those that need it and changes nothing else
FILTERING = ("largest", "cusum", "informed")
TIGHT = Contestant("brink 0", "brink?margin_c2=0", "brink, no margin")
PRINTED = {1: 6.3, 2: 43.0, 3: 125.0}  # the best ramp of the specification against MTD2


def _compromised(count: int, defender: str) -> Row:
    challenge = Challenge(Venue("hvac", "paper", {"num_compromised": count}), "attacker", defender, DAYS)
    of = (ATTACKER.name if defender == "mtd2" else AGAINST_MTD1.name,)
    above = Bar(every=True, of=of)
    bars = (above, Bar(value=PRINTED[count], of=of)) if defender == "mtd2" else (above,)
    return Row(f"{defender}, {count} of 4 sensors", (challenge,), bars, headline=(defender, count) == ("mtd2", 3))


ATTACK = Block(
    name="hvac-attack",
    title="HVAC attacker, A_impact",
    target="above every analytic attacker, against MTD2 and against MTD1; above 6.3, 43, 125 C2, the specification's "
    "best ramp against MTD2 with 1, 2, 3 of 4 sensors.",
    problem="hvac",
    role="attacker",
    metric="a_impact",
    learned=(ATTACKER, AGAINST_MTD1),
    baselines=(
        Contestant("constant"),
        LOWEST,
        *RAMPS,
        Contestant("brink"),
        TIGHT,
        *(Contestant(name, overrides=FILTERS) for name in ("listener", "tracker")),
    ),
    rows=tuple(_compromised(count, defender) for defender in ("mtd2", "mtd1") for count in (1, 2, 3)),
    unit="C2",
    shown=("flawed_steps",),
)
MIX = Block(
    name="hvac-defense",
    title="HVAC defender, A_impact over the mix of attacks",
    target="below every analytic defender on the preset `easy`, paired.",
    problem="hvac",
    role="defender",
    metric="a_impact",
    learned=(DEFENDER,),
    baselines=(
        *(Contestant(name) for name in ("none", "mtd1", "mtd2", "mtd2_calibrated", "model_only")),
        *(Contestant(name, overrides=FILTERS, optimum=name == "informed") for name in FILTERING),
    ),
    rows=(
        Row("the mix", (Challenge(Venue("hvac", "easy"), "defender", EASY_ATTACKERS, MIXED_DAYS),)),
        *(
            Row(attacker, (Challenge(Venue("hvac", "easy"), "defender", attacker, DAYS),), bars=())
            for attacker in ("none", "constant", "ramp", "root_ramp", "mimic")
        ),
        Row("hard level, the mix", (Challenge(Venue("hvac", "easy", HARD), "defender", EASY_ATTACKERS, DAYS),), ()),
        Row(
            "the learned attacker",
            (Challenge(Venue("hvac", "easy"), "defender", "zoo:hvac-attack-ppo", DAYS),),
            bars=(),
            without=FILTERING,
        ),
    ),
    bars=(Bar(every=True),),
    unit="C2",
    shown=("flawed_steps", "rejecting_steps"),
    notes=(
        "The mix: 15 % of the days attack-free, 30 % scripted, 55 % stealthy; the plant differs from the model by 2 % "
        "and 50 W, with 5 % and 100 W at the hard level.",
        "`largest`, `cusum` and `informed` see Kalman filters, beside which the learned attacker cannot play.",
    ),
)


SEARCHED_DEFENDER = Contestant("searched", "zoo:hvac-defense-cma", "searched, weighs sets of liars")
NOT_CALIBRATED = {"mtd2_calibrated": "has no threshold for the preset `learning`"}
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
    learned=(SEARCHED_DEFENDER,),
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


TRACKER = Contestant("searched", "zoo:hvac-attack-cma", "searched, hides in the drift")
BRINK = Contestant("searched", "zoo:hvac-attack-mtd2-cma", "searched, at the threshold")
DRIFTING_DAYS = 200
AIMS = {2: 42.0, 3: 140.0}  # C2 against MTD2; with one sensor nothing better than `brink` is known
HIDDEN_CHOICE = {"opportunist": "judges a defender by its choices, which `learning` hides from the attacker"}


def _liars(count: int) -> Mapping[str, Any]:
    return {"compromised_weights": (), "num_compromised": count} if count else {}


def _drifting(title: str, count: int, *, headline: bool = False) -> Row:
    venue = Venue("hvac", "learning", _liars(count))
    return Row(title, (Challenge(venue, "attacker", "zoo:hvac-defense-cma", DRIFTING_DAYS),), headline=headline)


def _checked(count: int) -> Row:
    venue = Venue("hvac", "paper", {"num_compromised": count})
    aim = (Bar(value=AIMS[count], or_equal=True, by_mean=True),) if count in AIMS else ()
    challenge = Challenge(venue, "attacker", "mtd2", DAYS)
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
        TIGHT,
        Contestant("ramp 0.7", "ramp?rate_c_per_h=0.7", "ramp 0.7 C/h"),
        *(Contestant(name, overrides=FILTERS) for name in ("listener", "tracker")),
    ),
    rows=tuple(map(_checked, (1, 2, 3))),
    unit="C2",
    shown=("flawed_steps",),
    notes=("`brink` with no margin is the attack that the search starts from.",),
)
BLOCKS = (ATTACK, MIX, LEARNED, MTD2, DEFENSE)
