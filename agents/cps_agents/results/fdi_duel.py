"""What the attackers and defenders of the FDI duel found by policy search have to reach: preset `learning`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_agents.arena.challenge import Challenge
from cps_agents.results.block import Bar, Block, Row
from cps_baselines.arena import Contestant, Venue
from cps_envs.core.types import Role

ATTACKER = Contestant("searched", "zoo:fdi-attack-cma")
DEFENDER = Contestant("searched", "zoo:fdi-defense-cma")
EPISODES, HONEST_EPISODES = 100, 2000
ATTACK_EPISODES = 400  # its leads over tracker are a tenth of what an episode pays more or less
ANSWERS = {  # the best that searches found against cusum and against bank, see docs/contest.md and docs/fdi.md
    "answer to cusum": "tracker?margin=0.8&late=1.5&swing=1&swing_s=0.5&range_part=1.2",
    "answer to chi2": "tracker?margin=1.072&late=2.299&swing=2.032&swing_s=0.9383&range_part=1.052",
}
UNFILTERED = "compares exact readings; with noise it doubts everything"
EXACT = "plans for exact sensors and certified optima; with a filter nothing is certified"
FEW_ALARMS = Bar(beat=("cusum", "bank"), metric="false_alarm", or_equal=True, by_mean=True)
ATTACKED: Mapping[str, Any] = {"attack_share": 1.0}


def _challenge(
    role: Role, opponent: str, overrides: Mapping[str, Any] = ATTACKED, episodes: int = EPISODES
) -> Challenge:
    return Challenge(Venue("fdi", "learning", overrides), role, opponent, episodes)


def _hidden(title: str, attacker: str, *, headline: bool = False) -> Row:
    return Row(
        f"against {title}", (_challenge("defender", attacker),), (Bar(every=True), FEW_ALARMS), headline=headline
    )


def _loud(attacker: str) -> Row:
    return Row(f"against {attacker}", (_challenge("defender", attacker),), bars=())


DEFENSE = Block(
    name="fdi-defense-searched",
    title="FDI defender of the duel by policy search, impact speed",
    target="below every analytic defender against attackers that hide, with no more episodes with a false alarm than "
    "cusum and bank; no collision in 2,000 episodes without an attack.",
    problem="fdi",
    role="defender",
    metric="worst_impact_mps",
    learned=(DEFENDER,),
    baselines=(
        Contestant("cusum"),
        Contestant("bank"),
        Contestant("informed", title="informed, told the sensors", optimum=True),
    ),
    rows=(
        _hidden("tracker", "tracker", headline=True),
        _hidden("blind_tracker", "blind_tracker"),
        *(_hidden(title, attacker) for title, attacker in ANSWERS.items()),
        _hidden("searched attacker", "zoo:fdi-attack-cma"),
        *map(_loud, ("swing", "bang_bang", "random")),
        Row(
            "nobody attacks",
            (_challenge("defender", "none", {"attack_share": 0.0}, HONEST_EPISODES),),
            (FEW_ALARMS, Bar(value=0.0, metric="collided_pairs", or_equal=True, by_mean=True)),
        ),
    ),
    unit="m/s",
    shown=("return", "false_alarm", "collided_pairs"),
    notes=("Every episode of the other rows is attacked. The lead's gap has no second pair of sensors.",),
    left_out=dict.fromkeys(("kinematic", "redundancy", "model"), UNFILTERED),
)


def _defended(defender: str) -> Row:
    bar = Bar(beat=("tracker", "blind_tracker"))
    return Row(f"against {defender}", (_challenge("attacker", defender, episodes=ATTACK_EPISODES),), (bar,))


ATTACK = Block(
    name="fdi-attack-searched",
    title="FDI attacker of the duel by policy search, pay",
    target="above tracker and blind_tracker against every analytic defender that uses a sensor.",
    problem="fdi",
    role="attacker",
    metric="return",
    learned=(ATTACKER,),
    baselines=(Contestant("tracker"), Contestant("blind_tracker")),
    rows=(
        *map(_defended, ("cusum", "redundant_cusum", "bank", "chi2", "none")),
        Row("against model_only", (_challenge("attacker", "model_only"),), bars=()),
        Row("against the searched defender", (_challenge("attacker", "zoo:fdi-defense-cma"),), ()),
    ),
    unit="m/s",
    shown=("worst_impact_mps", "detected"),
    notes=("`model_only` uses no reading: no attack changes anything.",),
    left_out=dict.fromkeys(("bnb", "lp_greedy", "oracle", "shielded"), EXACT),
)

BLOCKS = (DEFENSE, ATTACK)
