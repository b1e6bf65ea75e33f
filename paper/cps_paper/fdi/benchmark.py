"""The benchmark of false data injection: attackers on tasks, and attackers against defenders."""

from __future__ import annotations

from cps_agents.arena.table import Table
from cps_agents.arena.venue import Venue
from cps_envs.core.declare.panel import Contestant
from cps_paper.benchmark.schedule import Benchmark

TASKS = ("x1>1", "x2>2", "x4>4", "x3>4", "v1>1", "v4>4", "x1,2>1", "v1,2>1", "xv4>4")
EPISODES = 200  # of attackers that draw
ATTACKERS = (
    Contestant("none"),
    Contestant("random", episodes=EPISODES),
    Contestant("bang_bang", episodes=EPISODES),
    Contestant("lp_greedy"),
    Contestant("oracle"),
    Contestant("bound", policy="none", title="certified bound", metric="oracle_bound_mps"),
)


def _column(task: str) -> Contestant:
    """Nobody defends; the column is a task, such as "x1>1"."""
    attacked, target = task.split(">")
    name = f"{attacked.replace(',', '')}-{target}"
    return Contestant(name, "none", title=task, overrides={"attacked": attacked, "target": int(target)})


UNDEFENDED = Table(
    name="tasks",
    title="Set A, 20 steps, undefended: attacked sensors > target",
    metric="impact_speed_mps",
    venue=Venue("fdi", "paper"),
    attackers=ATTACKERS,
    defenders=tuple(map(_column, TASKS)),
    per="oracle_value_mps",
    axis="task",
    form="{value:.2f}\n{share:.0%}",
    legend="impact speed of the target in m/s, mean over the episodes; share of the highest speed known",
)
DEFENSE = Table(
    name="defense",
    title="Extension: disturbed platoons, clipped limits, 100 steps, tasks drawn from the feasible ones",
    metric="worst_impact_mps",
    venue=Venue("fdi", "defense"),
    attackers=(
        Contestant("none"),
        Contestant("random"),
        Contestant("bang_bang"),
        Contestant("oracle", policy="oracle?start=random", title="oracle, random start"),
    ),
    defenders=tuple(Contestant(name) for name in ("none", "kinematic", "redundancy", "model", "model_only")),
    episodes=EPISODES,
    form="{value:.2f}\n{replaced_share:.0%} / {false_alarm_rate:.1%}",
    legend="worst impact speed in m/s; readings replaced / of those without injection, means over the episodes",
)

BENCHMARK = Benchmark(
    problem="fdi",
    tables=(UNDEFENDED, DEFENSE),
    crash_metric="collided_pairs",
    notes=(
        "The bound holds for every attacker of these episodes; where `oracle` is below it the optimum is open.",
        "The paper's Algorithm 2, `bnb`, has another goal, growing errors, and needs 12 to 30 s: `reproduce fig 3.2`.",
        "`random` is uniform over the mask; `bang_bang` takes the lowest or the highest legal injections in turns.",
        "`lp_greedy` keeps a reserve that was chosen among five values on the tasks of set A, which include these.",
        "The defenders go beyond the paper, which has none. No bound holds against them. Sensors have no noise here.",
    ),
)
