"""What the attacker that plans in its model has to reach where starts and gains are drawn: preset `drawn`."""

from __future__ import annotations

from cps_agents.arena.challenge import Challenge
from cps_agents.recipes.fdi import DRAWN_TASKS
from cps_agents.results.block import Bar, Block, Row
from cps_baselines.arena import Contestant, Venue

ATTACKER = Contestant("planner", "zoo:fdi-attack-drawn-cma")
EPISODES, OF_LP = 64, 16  # `lp_greedy` takes a second or two for each
SHARE = 0.85  # of the certified bound
BOUND_MPS = 3.2278  # the mean of what `cps-envs oracle --preset drawn --episodes 64 --time-limit 10` certifies
TITLES = {
    "own": "the pair of the attacked sensor",
    "last": "a pair ahead of the last vehicle, which is attacked",
    "next": "the next pair ahead",
    "far": "two pairs ahead",
}
FILTERED = "needs the Kalman filter's innovations: estimator kalman, which this preset lacks"


def _row(title: str, bars: tuple[Bar, ...], bound: str = "", **overrides: str) -> Row:
    without = () if bars else ("lp_greedy",)
    challenge = Challenge(Venue("fdi", "drawn", overrides), "attacker", "none", EPISODES)
    return Row(title, (challenge,), bars, bound=bound, without=without)


ATTACK = Block(
    name="fdi-attack-drawn",
    title="FDI attacker with drawn starts and gains, impact speed",
    target="at least 85 % of the certified bound of the same episodes, and above every analytic attacker.",
    problem="fdi",
    role="attacker",
    metric="impact_speed_mps",
    learned=(ATTACKER,),
    baselines=(Contestant("lp_greedy", episodes=OF_LP), Contestant("bang_bang")),
    rows=(
        _row(
            "all 17 tasks",
            (Bar(value=SHARE * BOUND_MPS, or_equal=True, by_mean=True), Bar(every=True)),
            f"certified bound {BOUND_MPS:.2f}",
        ),
        *(_row(TITLES[kind], (), tasks=tasks) for kind, tasks in DRAWN_TASKS.items()),
    ),
    unit="m/s",
    shown=("collided_target", "illegal"),
    notes=(
        "Nobody defends. But for an own pair, two pairs have to collide in the same sample. In 5 of the 64 episodes "
        "with all tasks that is proved to be impossible, which counts as 0 on both sides.",
        "`cps-envs oracle --preset drawn --episodes 64 --time-limit 10` certifies the bound episode by episode. No "
        "attack is faster, and some bounds are not attained.",
        "The three plans that the attacker begins with were set by hand, after a look at certified plans of such "
        "episodes. Its numbers were searched on training seeds.",
    ),
    left_out={
        **dict.fromkeys(("tracker", "blind_tracker", "mimic"), FILTERED),
        "oracle": "replays plans found for a start at rest and the usual gains",
    },
)
BLOCKS = (ATTACK,)
