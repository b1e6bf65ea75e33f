"""What the trained policies of the HVAC problem have to reach: target 4."""

from __future__ import annotations

from cps_agents.arena.challenge import Challenge
from cps_agents.results.block import Bar, Block, Row
from cps_agents.results.hvac_attack_search import BLOCKS as SEARCHED_ATTACKS
from cps_agents.results.hvac_search import BLOCKS as SEARCHED
from cps_baselines.arena import Contestant, Venue
from cps_baselines.hvac.calibration import HARD
from cps_envs.hvac.problem import EASY_ATTACKERS

ATTACKER = Contestant("learned", "zoo:hvac-attack-ppo", "learned on MTD2")
AGAINST_MTD1 = Contestant("learned-mtd1", "zoo:hvac-attack-mtd1-ppo", "learned on MTD1")
DEFENDER = Contestant("learned", "zoo:hvac-defense-ppo")
DAYS = 20  # of the preset `paper`
MIXED_DAYS = 200  # of the preset `easy`
RATES_C_PER_H = (0.5, 0.6, 0.7, 0.8)
RAMPS = (
    *(Contestant(f"ramp {rate}", f"ramp?rate_c_per_h={rate}", f"ramp {rate} C/h") for rate in RATES_C_PER_H),
    Contestant("root_ramp"),
    Contestant("mimic"),
)
LOWEST = Contestant("lowest", "constant?reading_c=10", "lowest reading, 10 C")
FILTERS = {"kalman_filters": True}  # shows more to those that need it and changes nothing else
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

BLOCKS = (ATTACK, MIX, *SEARCHED_ATTACKS, *SEARCHED)
