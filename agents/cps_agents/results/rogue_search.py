"""What the rogue defender of preset `learning` found by policy search has to reach."""

from __future__ import annotations

from cps_agents.arena.challenge import Challenge
from cps_agents.results.block import Bar, Block, Row
from cps_baselines.arena import Contestant, Venue
from cps_baselines.rogue.players import ATTACKERS, DEFENDERS

MONITOR = Contestant("searched", "zoo:rogue-defense-monitor-cma", "searched, monitor")
EPISODES = 40
HARDEST = ("contested?against=assigned", "contested?against=monitor", "contested?against=sliding", "switching")
VENUE = Venue("rogue", "learning")


def _against(*attackers: str) -> tuple[Challenge, ...]:
    return tuple(Challenge(VENUE, "defender", attacker, EPISODES) for attacker in attackers)


DEFENSE = Block(
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
BLOCKS = (DEFENSE,)
