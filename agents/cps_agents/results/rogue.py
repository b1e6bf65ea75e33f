"""What the trained policies of the rogue-vehicle problem have to reach: target 5, and preset `learning`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_agents.arena.challenge import Challenge
from cps_agents.results.block import Bar, Block, Row
from cps_baselines.arena import Contestant, Venue
from cps_baselines.rogue.contest import ATTACKERS, DEFENDERS
from cps_baselines.rogue.switching_search import DEFENDERS as CONTROLLERS
from cps_baselines.rogue.switching_search import RATIOS, SETTING, SPREAD
from cps_baselines.rogue.yardsticks import RATIOS as ALL_RATIOS
from cps_baselines.rogue.yardsticks import best_known, shipped
from cps_envs.rogue.config import PAPER

ATTACKER = Contestant("learned", "zoo:rogue-attack-ppo", "learned, no memory")
RECURRENT = Contestant("recurrent", "zoo:rogue-attack-recurrent", "learned, with memory")
TEACHER = Contestant(
    "teacher",
    title="teacher, told the controller",
    prepare="cps_agents.results.searches:told",
    for_each=True,
    optimum=True,
)
ORACLE = Contestant("beam", "beam?width=96", episodes=2, title="beam search, told the episode", optimum=True)
AIMS = {1.0: 70.0, 1.1: 80.0, 1.2: 80.0, 1.3: 96.0}  # m/s by power ratio, mean over the controllers
TAUGHT = Bar(beat=(TEACHER.name,), factor=0.95, or_equal=True, of=(RECURRENT.name,))  # who is told what it finds out
DEFENDER = Contestant("learned", "zoo:rogue-defense-ppo", "learned, chooses laws")
BOXES_IN = Contestant("searched", "zoo:rogue-defense-cma", "searched, boxes in")
ASSIGNED = Contestant("shll", "assigned?laws=shll", "best fixed assignment, shll")
WAVES = ("duty_square", "square")
JUDGES = ("zoo:rogue-attack-ppo", "switching", *WAVES)
FRESH = {  # what searches found against the shipped BOXES_IN, and against its earlier numbers, see docs/rogue.md
    1.0: "tuned?front_gap=1.958&front_rate=0.3993&rear_gap=0.3928&rear_rate=-0.04362&excess=-0.4176&bias=0.02732"
    "&hysteresis=-0.3296",
    1.2: "tuned?front_gap=-0.13&front_rate=0.15&rear_gap=1.48&rear_rate=0.26&excess=-1.62&bias=-2.53&hysteresis=-0.06",
    1.3: "tuned?front_gap=2.686&front_rate=-1.807&rear_gap=0.3042&rear_rate=-0.1701&excess=-0.5271&bias=-1.863"
    "&hysteresis=0.01748",
}
WORLDS = 16
KNOWN = shipped()
TRACKING = "formation_cost_s"
VERIFIED = "Solid contact, 60 s, half the integration step, drive and drag drawn within 0.3 %."


def world(power_ratio: float) -> Mapping[str, Any]:
    """The head-room table's setting as it verifies: half the step, perturbed drive and drag."""
    drawn = {
        name: (getattr(PAPER, name) * (1 - SPREAD), getattr(PAPER, name) * (1 + SPREAD))
        for name in ("drive_mps2", "drag_per_s")
    }
    return {**SETTING, **drawn, "power_ratio": power_ratio, "dt_s": PAPER.dt_s / 2}


def _attacked(defender: str, ratio: float) -> Row:
    challenge = Challenge(Venue("rogue", "paper", world(ratio)), "attacker", defender, WORLDS)
    known = best_known(KNOWN, ratio, defender)
    return Row(
        f"{defender}, ratio {ratio:g}", (challenge,), (Bar(every=True), TAUGHT, Bar(value=known)), best_known=known
    )


def _coarse(ratio: float) -> Row:
    overrides = {**world(ratio), "dt_s": PAPER.dt_s}
    challenges = tuple(
        Challenge(Venue("rogue", "paper", overrides), "attacker", defender, WORLDS) for defender in CONTROLLERS
    )
    return Row(f"all six at the full step, ratio {ratio:g}", challenges, bars=())


def _fine(ratio: float) -> Row:
    challenges = tuple(row.challenges[0] for row in (_attacked(defender, ratio) for defender in CONTROLLERS))
    best = sum(best_known(KNOWN, ratio, defender) for defender in CONTROLLERS) / len(CONTROLLERS)
    bars = (Bar(every=True), TAUGHT, Bar(value=AIMS[ratio], or_equal=True))
    return Row(f"all six, ratio {ratio:g}", challenges, bars, best_known=best, headline=True)


ATTACK = Block(
    name="rogue-attack",
    title="rogue attacker, damage",
    target="above every analytic attacker, against each controller, at power ratios that training did and did not see.",
    problem="rogue",
    role="attacker",
    metric="damage",
    learned=(ATTACKER, RECURRENT),
    baselines=(
        Contestant("square", title="square, 0.1 Hz"),
        Contestant("wave", title="best wave", prepare="cps_agents.results.searches:best_wave", for_each=True),
        Contestant("switching", title="switching, general"),
        *(Contestant(f"switching {name}", f"switching?against={name}", f"switching, {name}") for name in CONTROLLERS),
        TEACHER,
        ORACLE,
    ),
    rows=(
        *(_attacked(defender, ratio) for ratio in ALL_RATIOS for defender in CONTROLLERS),
        *map(_fine, ALL_RATIOS),
        *map(_coarse, RATIOS),
    ),
    unit="m/s",
    shown=("reference_error_m",),
    notes=(
        VERIFIED,
        "Best known is the best of four searches (`python -m cps_baselines.rogue.yardsticks`). Three of them are told "
        "the controller or plan on copies of the world. It is the number in a bar, except in the rows of all six.",
        "The teacher is told the controller; `probe` finds it out.",
        "A policy that needs the full step to do its damage exploits the chatter of the integration.",
    ),
)


def _challenge(attacker: str, ratio: float) -> Challenge:
    return Challenge(Venue("rogue", "paper", world(ratio)), "defender", attacker, WORLDS)


def _defended(attacker: str, ratio: float) -> Row:
    return Row(f"against {attacker}, ratio {ratio:g}", (_challenge(attacker, ratio),))


EIGHT = tuple(_challenge(attacker, ratio) for attacker in JUDGES for ratio in RATIOS)
DEFENSE = Block(
    name="rogue-defense",
    title="rogue defender, damage",
    target="below every analytic defender, at no worse tracking than sliding mode with detection; in the mean of the "
    "eight rows at most 20 m/s at a cost of at most 13 s, and at most 45 m/s against a fresh search.",
    problem="rogue",
    role="defender",
    metric="damage",
    learned=(DEFENDER, BOXES_IN),
    baselines=(*map(Contestant, CONTROLLERS), ASSIGNED),
    rows=(
        Row(
            "mean of the eight rows below",
            EIGHT,
            (
                Bar(every=True),
                Bar(value=20.0, or_equal=True, by_mean=True),
                Bar(value=13.0, metric=TRACKING, or_equal=True, by_mean=True),
            ),
            headline=True,
        ),
        *(_defended(attacker, ratio) for attacker in JUDGES for ratio in RATIOS),
        *(
            Row(
                f"fresh search against the one that boxes in, ratio {ratio:g}",
                (_challenge(attacker, ratio),),
                (Bar(value=45.0, or_equal=True, of=(BOXES_IN.name,)),),
            )
            for ratio, attacker in FRESH.items()
        ),
        *(
            Row(
                f"against zoo:rogue-attack-recurrent, ratio {ratio:g}",
                (_challenge("zoo:rogue-attack-recurrent", ratio),),
                (),
            )
            for ratio in RATIOS
        ),
    ),
    bars=(
        Bar(every=True),
        Bar(beat=("sliding_detection",), metric=TRACKING, or_equal=True, by_mean=True),
    ),
    unit="m/s",
    shown=(TRACKING, "reference_error_m"),
    notes=(
        VERIFIED,
        "Tracking is the integral of the formation's scattering, formation_cost_s.",
        "The attack at ratio 1.3 was searched against the training seed that plays by default, those at 1 and 1.2 "
        "against earlier numbers of this policy.",
    ),
    left_out={"monitor": "gives orders to the seized vehicle too, which this setting does not allow"},
)


MONITOR = Contestant("searched", "zoo:rogue-defense-monitor-cma", "searched, monitor")
EPISODES = 40
HARDEST = ("contested?against=assigned", "contested?against=monitor", "contested?against=sliding", "switching")
VENUE = Venue("rogue", "learning")


def _against(*attackers: str) -> tuple[Challenge, ...]:
    return tuple(Challenge(VENUE, "defender", attacker, EPISODES) for attacker in attackers)


HIDDEN = Block(
    name="rogue-defense-hidden",
    title="rogue defender by policy search where the attacker is hidden, pay",
    target="below every analytic defender in the mean over all attackers of the contest.",
    problem="rogue",
    role="defender",
    metric="return",
    learned=(MONITOR,),
    baselines=(
        *(each for each in DEFENDERS if each.policy),
        Contestant("informed", title="informed, told seat, onset and attacker", optimum=True),
    ),
    rows=(
        Row(
            "mean over all attackers of the contest",
            _against(*(each.reference for each in ATTACKERS)),
            (Bar(every=True),),
            headline=True,
        ),
        *(Row(attacker, _against(attacker), ()) for attacker in HARDEST),
        Row("nobody attacks", _against("none"), ()),
    ),
    unit="m/s",
    shown=("damage", "formation_cost_s"),
    notes=(
        "Pay is the damage and 0.2 m/s for each second of formation cost.",
        "How far fresh attacks exploit it: `cps-envs best-response rogue attacker "
        "--against zoo:rogue-defense-monitor-cma --oracle search`.",
    ),
)
BLOCKS = (ATTACK, DEFENSE, HIDDEN)
