"""What the trained policies of false data injection have to reach: target 3."""

from __future__ import annotations

from cps_agents.arena.challenge import Challenge
from cps_agents.results.block import Bar, Block, Row
from cps_agents.results.fdi_drawn import BLOCKS as DRAWN
from cps_agents.results.fdi_duel import BLOCKS as DUEL
from cps_baselines.arena import Contestant, Venue
from cps_envs.fdi.optima import known_within
from cps_envs.fdi.problem import FDI
from cps_envs.fdi.task import Task

ATTACKER = Contestant("learned", "zoo:fdi-attack-ppo")
DEFENDER = Contestant("learned", "zoo:fdi-defense-ppo")
DRAWS = 200  # episodes of attackers that draw, and of the preset `defense`
CUT = 0.2  # of the impact speed may be left
FALSE_ALARMS = 0.02
FILTERED = "needs the Kalman filter's innovations: estimator kalman, which this preset lacks"
SHARES = {1: 0.90, 2: 0.75}  # of the certified optimum, by the number of attacked sensors


def feasible_tasks(count: int) -> list[Task]:
    """The tasks of set A with so many attacked sensors for which an attack is known."""
    records = known_within(FDI.config("easy", {}))
    return [task for task, record in records.items() if record.feasible and task.sensors.count == count]


def _challenge(task: Task) -> Challenge:
    return Challenge(Venue("fdi", "easy", {"tasks": str(task)}), "attacker", "none", 1)


def _mean(title: str, count: int) -> Row:
    tasks = feasible_tasks(count)
    return Row(
        f"{title}, {len(tasks)} tasks", tuple(map(_challenge, tasks)), (Bar(value=SHARES[count], or_equal=True),)
    )


def _bounded(title: str, count: int) -> Row:
    challenges = tuple(map(_challenge, feasible_tasks(count)))
    return Row(f"{title}, share of the certified bound", challenges, bars=(), per="oracle_bound_mps")


ATTACK = Block(
    name="fdi-attack",
    title="FDI attacker, share of the certified optimum",
    target="on average at least 90 % of the optimum over the feasible single-sensor tasks, 75 % over two sensors.",
    problem="fdi",
    role="attacker",
    metric="impact_speed_mps",
    per="oracle_value_mps",
    learned=(ATTACKER,),
    baselines=(
        Contestant("random", title="random, masked", episodes=DRAWS),
        Contestant("bang_bang", episodes=DRAWS),
        Contestant("lp_greedy"),
        Contestant("oracle", title="optimum", optimum=True),
    ),
    rows=(
        _mean("one sensor", 1),
        _mean("two sensors", 2),
        *(_bounded(title, count) for title, count in (("one sensor", 1), ("two sensors", 2))),
        *(Row(str(task), (_challenge(task),), bars=()) for task in feasible_tasks(1)),
    ),
    form="{:.1%}",
    notes=(
        "Set A, 20 steps, no defence, nothing drawn: one episode per task. Regret is 100 % minus the share.",
        "`optimum` replays the best plan that the integer program found. Where it is not proved to be optimal, the "
        "certified bound is higher; shares of the bound have rows of their own.",
    ),
    left_out=dict.fromkeys(("tracker", "blind_tracker"), FILTERED),
)


CUT_BAR = Bar(beat=("none",), factor=CUT, or_equal=True)
FEW_ALARMS = Bar(value=FALSE_ALARMS, metric="false_alarm_rate")


def _defended(attacker: str) -> Row:
    return Row(
        f"against {attacker}",
        (Challenge(Venue("fdi", "defense"), "defender", attacker, DRAWS),),
        (CUT_BAR, Bar(every=True, or_equal=True), FEW_ALARMS),
    )


DEFENSE = Block(
    name="fdi-defense",
    title="FDI defender, impact speed",
    target="impact speeds of the learned attacker and of the replayed optimum cut by at least 80 %, at most those "
    "of every analytic defender, under 2 % false alarms.",
    problem="fdi",
    role="defender",
    metric="worst_impact_mps",
    learned=(DEFENDER,),
    baselines=tuple(Contestant(name) for name in ("none", "kinematic", "redundancy", "model", "model_only")),
    rows=(
        _defended("oracle?start=random"),
        _defended("zoo:fdi-attack-ppo"),
        _defended("zoo:fdi-attack-disturbed-ppo"),
        Row(
            "attack-free",
            (Challenge(Venue("fdi", "defense"), "defender", "none", DRAWS),),
            (FEW_ALARMS,),
        ),
    ),
    unit="m/s",
    shown=("false_alarm_rate", "replaced_share"),
    notes=("Extension: disturbed platoons, clipped limits, 100 steps, tasks drawn from the feasible ones.",),
    left_out=dict.fromkeys(("bank", "chi2", "cusum", "redundant_cusum"), FILTERED),
)

BLOCKS = (ATTACK, *DRAWN, DEFENSE, *DUEL)
