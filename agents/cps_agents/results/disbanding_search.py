"""What the disbanding defenders have to reach: targets, safety, robustness; found by policy search, and by PPO."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cps_agents.arena.challenge import Challenge
from cps_agents.recipes.disbanding import LOSSY
from cps_agents.results.block import Bar, Block, Row
from cps_baselines.arena import Contestant, Venue

TAUS_S = (0.1, 0.3, 0.5)
EPISODES = 20
LEFT_OUT = {
    "informed": "is told the truth",
    "joint": "is told the state and solves one program for all vehicles",
}
BROADCAST = Contestant("broadcast", "zoo:disbanding-defense-cma", "searched, broadcast")
LOCAL = Contestant("local_signals", "zoo:disbanding-defense-local-cma", "searched, local signals")
RESIDUAL = Contestant("residual", "zoo:disbanding-defense-residual", "searched, broadcast, network beside it")
PPO = Contestant("learned", "zoo:disbanding-defense-ppo", "PPO, broadcast")
BASELINES = (Contestant("feedback"),)  # and every other registered defender; see `rivals`
COLLISIONS, GAP = "collided_intact>0", "smallest_gap_m"
SAFE = (
    Bar(value=0.0, metric="collided_intact", or_equal=True, by_mean=True),
    Bar(value=1.5, metric=GAP, less=False, or_equal=True, by_mean=True),
)
# Means at tau = 0.1, 0.3 and 0.5 s that the searched policies should reach, by table, x_d in m and policy.
LIMITS: Mapping[tuple[str, float, str], tuple[float, float, float]] = {
    ("2.2", 5.0, "broadcast"): (15.5, 15.9, 16.7),
    ("2.2", 4.0, "broadcast"): (15.9, 16.5, 17.4),
    ("2.3", 5.0, "broadcast"): (26.8, 28.2, 29.9),
    ("2.3", 4.0, "broadcast"): (27.5, 29.1, 31.0),
    ("2.2", 5.0, "local_signals"): (16.5, 16.8, 18.0),
    ("2.2", 4.0, "local_signals"): (17.1, 17.6, 18.5),
    ("2.3", 5.0, "local_signals"): (27.8, 28.9, 30.6),
}


def _cell(table: str, attack: str, metric: str, gap_m: float, number: int) -> Row:
    overrides = {"tau_s": TAUS_S[number], "desired_gap_m": gap_m, "report": "safety"}
    challenge = Challenge(Venue("disbanding", "paper", overrides), "defender", attack, 1)
    limits = tuple(
        Bar(value=LIMITS[table, gap_m, each.name][number], or_equal=True, by_mean=True, of=(each.name,))
        for each in (BROADCAST, LOCAL)
        if (table, gap_m, each.name) in LIMITS
    )
    title = f"Table {table}, tau = {TAUS_S[number]} s, x_d = {gap_m:g} m"
    return Row(title, (challenge,), (Bar(every=True), *limits, *SAFE), metric)


CELLS = Block(
    name="disbanding-defense-searched",
    title="disbanding defenders, the twelve cells of Tables 2.2 and 2.3",
    target="below every analytic defender and the stated means at each tau, no collision, no gap below 1.5 m.",
    problem="disbanding",
    role="defender",
    metric="velocity_error_intact",
    learned=(BROADCAST, RESIDUAL, LOCAL, PPO),
    baselines=BASELINES,
    rows=tuple(
        _cell(*table, gap_m, number)
        for table in (("2.2", "lead", "velocity_error_intact"), ("2.3", "table_2_3", "velocity_error_all"))
        for gap_m in (5.0, 4.0)
        for number in range(len(TAUS_S))
    ),
    unit="percent",
    shown=("collided_intact", GAP),
    notes=("Table 2.2 counts the intact vehicles, Table 2.3 all. The cells lie among what the search plays.",),
    left_out=LEFT_OUT,
)


def _robust(title: str, attack: str, overrides: Mapping[str, Any], *, preset: str = "easy") -> Row:
    settings = {"report": "safety", **overrides}
    return Row(title, (Challenge(Venue("disbanding", preset, settings), "defender", attack, EPISODES),))


LAGS: Mapping[str, Any] = {"tau_s": (0.08, 0.55)}
NOISE: Mapping[str, Any] = {"correction_noise_mps2": 0.5}
ROBUST = Block(
    name="disbanding-defense-robust",
    title="disbanding defenders by policy search on unseen roads",
    target="below every analytic defender in every row, paired, with collisions in at most 2 % of the episodes.",
    problem="disbanding",
    role="defender",
    metric="return",
    learned=(BROADCAST, RESIDUAL, LOCAL),
    baselines=BASELINES,
    rows=(
        _robust("easy, random", "random", {}),
        _robust("easy, lead", "lead", {}),
        _robust("easy, spread", "spread", {}),
        _robust("lag 0.08 to 0.55 s, lead", "lead", LAGS),
        _robust("lag 0.08 to 0.55 s, spread", "spread", LAGS),
        _robust("actuator noise 0.5 m/s2, lead", "lead", NOISE),
        *(
            _robust(f"actuator noise 0.5 m/s2, second attack {pause_s} s later", f"timed?pause_s={pause_s}", NOISE)
            for pause_s in (5, 40, 130)
        ),
    ),
    bars=(
        Bar(every=True),
        Bar(value=2.0, metric=COLLISIONS, or_equal=True, by_mean=True),
    ),
    unit="points of E_v and of the penalty for collisions",
    shown=(COLLISIONS, GAP),
    notes=(f"{COLLISIONS} is the percentage of episodes in which an intact vehicle collides.",),
    left_out=LEFT_OUT,
)


RADIO = Contestant("radio", "zoo:disbanding-defense-radio-cma", "searched, late warning")
PAUSES = ",".join(f'"timed?pause_s={pause_s}"' for pause_s in (5, 20, 40, 75, 130))
TWO = f"mixture?policies=[{PAUSES}]"
AT_40_S = "timed?pause_s=40"
MANY = 100  # episodes of the rows that say how much worse 0.2 s is
JAMS = {
    "the first": "timed?jam=1",
    "the second": "timed?jam=2",
    "the third, after the attack": "timed?jam=3&jam_s=0",
}  # as in the contest
RARE = Bar(value=5.0, metric=COLLISIONS, or_equal=True, by_mean=True)
BELOW_ALL = Bar(every=True)


def _radio(title: str, attack: str, *bars: Bar, episodes: int = EPISODES, **overrides: Any) -> Row:
    venue = Venue("disbanding", "learning", {**LOSSY, **overrides})
    return Row(title, (Challenge(venue, "defender", attack, episodes),), bars)


def _at_most(points: float) -> Bar:
    return Bar(value=points, or_equal=True, by_mean=True)


LATE = Block(
    name="disbanding-defense-radio",
    title="disbanding defender by policy search where the warning comes late",
    target="with 0.1 s and 30 % lost per link at most 18.0 against the lead attack and 30.2 against timed attacks, "
    "with collisions in at most 5 % of the episodes; with 0.2 s at most 20.5, 31 and, where nobody attacks, 1; below "
    "every analytic defender.",
    problem="disbanding",
    role="defender",
    metric="return",
    learned=(RADIO,),
    baselines=(Contestant("string"), Contestant("informed", title="informed, told at once", optimum=True)),
    rows=(
        _radio("lead", "lead", _at_most(18.0), RARE, BELOW_ALL, episodes=MANY),
        _radio("second attack 40 s later", AT_40_S, _at_most(30.2), RARE, BELOW_ALL, episodes=MANY),
        _radio("timed attacks, 5 to 130 s apart", TWO, _at_most(30.2), RARE, BELOW_ALL),
        _radio("timed attacks, lag 0.08 to 0.55 s", TWO, tau_s=(0.08, 0.55)),
        _radio("nobody attacks", "none"),
        *(_radio(f"timed attacks, jam behind {place}", attack, BELOW_ALL) for place, attack in JAMS.items()),
        _radio("0.2 s, lead", "lead", _at_most(20.5), BELOW_ALL, episodes=MANY, hop_delay_s=0.2),
        _radio("0.2 s, second attack 40 s later", AT_40_S, _at_most(31.0), BELOW_ALL, episodes=MANY, hop_delay_s=0.2),
        _radio("0.2 s, nobody attacks", "none", _at_most(1.0), hop_delay_s=0.2),
    ),
    unit="points of E_v and of the penalty for collisions",
    shown=(COLLISIONS, GAP),
    notes=(
        "Preset `learning` with 0.1 s per link, or 0.2 s where a row says so, and 30 % of the messages lost. Actuators "
        "have noise of 0.5 m/s2, and 30 % of the drivers brake. The budget of 1 to 3 platoons is drawn, so some "
        "episodes have one attack only.",
        f"{COLLISIONS} is the percentage of episodes in which an intact vehicle collides.",
    ),
    left_out=dict.fromkeys(("joint", "mpc_tuned"), "takes half a second or more for an episode"),
)
BLOCKS = (CELLS, ROBUST, LATE)
