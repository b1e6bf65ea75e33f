"""Speed and memory by size: rows of a table, to which a size is added by a line."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from time import process_time
from typing import Any

import gymnasium
import numpy as np

from cps_envs.core.compute.generators import seeded
from cps_envs.core.game.problem import Problem
from cps_envs.hvac.houses import house
from tools.bench.interfaces import OPPONENT, vector
from tools.bench.row import ROUNDS, Call, Measurement, Values, Yardsticks, calls_per_s, microseconds

PART = "sizes"
ENVS = 64
LATE_STEPS = 48  # three times as many as HVAC sums at once, see `cps_envs.hvac.window`
OPERATIONS = 7  # of a step of the simplest vehicle, see `tools.bench.interfaces`
FEW = 1  # environments whose memory is compared with that of `Size.many`


@dataclass(frozen=True)
class Size:
    """A size of a problem; `paper` with some fields replaced."""

    problem: str
    name: str  # unique in its problem
    overrides: Mapping[str, Any] = field(default_factory=dict)
    attack: str = ""  # an attacker's policy: then the game alone is measured after its first 10 s, without interface
    operations: float = 0.0  # of a substep, counted in the source, without divisions; 0: not counted
    divisions: float = 0.0  # of a substep
    reached: float = 0.0  # share of the speed that these allow, to be reached at least; 0: no target
    per_s: float = 0.0  # substeps per CPU second to be reached on the machine of docs/speed.md; 0: no target
    cheaper: tuple[str, float] = ("", 0.0)  # than another size: its name, and the share of its cost that is allowed
    envs: int = ENVS
    many: int = 65  # environments whose memory is measured
    late: bool = False  # measured in the same part of an episode, whatever the batch


# Counted in the kernel, for a vehicle: look 2, command 7, avoidance 11, Euler 15, contact 3, errors 6, stops 6. Other
# kernels have no such number: false data leaves out what is zero, and rogue's controllers differ by vehicle.
CALM = (50.0, 2.0)
COLLIDING = {"tau_s": 0.5, "desired_gap_m": 4.0, "takeover_delay_s": 2.0}  # 75 of 100 vehicles in the end
SIZES = (
    Size("disbanding", "4 vehicles", {"num_platoons": 2, "vehicles_per_platoon": 2}, cheaper=("100 vehicles", 0.1)),
    Size("disbanding", "100 vehicles", {}, "", *CALM, reached=0.4, per_s=2.0e8),
    Size("disbanding", "1,000 vehicles", {"num_platoons": 100}, "", *CALM, 0.4, cheaper=("100 vehicles", 10.0)),
    Size("disbanding", "10,000 vehicles", {"num_platoons": 1000}, "", *CALM, 0.4, cheaper=("1,000 vehicles", 10.0)),
    Size(
        "disbanding", "100,000 vehicles", {"num_platoons": 10_000}, "", *CALM, 0.4, 0.0, ("10,000 vehicles", 11.0), 1, 3
    ),
    Size("disbanding", "100, collisions", COLLIDING, attack="plan?events=[[10,1],[9,2]]", per_s=1.3e8),
    Size("fdi", "4 vehicles"),
    Size("fdi", "20 vehicles", {"num_vehicles": 20}, cheaper=("4 vehicles", 5.0)),
    Size("fdi", "100 vehicles", {"num_vehicles": 100}, cheaper=("20 vehicles", 5.0)),
    Size("hvac", "4 sensors"),
    Size("hvac", "1,000 at once", envs=1000, late=True),
    Size("hvac", "10,000 at once", envs=10_000, late=True, cheaper=("1,000 at once", 1.2)),
    Size("hvac", "8 sensors", {"num_sensors": 8}),
    Size("hvac", "4 zones", house(4)),
    Size("hvac", "16 zones", house(16), late=True),
    Size("hvac", "64 zones", house(64), late=True),
    Size("rogue", "5 vehicles", per_s=1.5e8),
    Size("rogue", "30 vehicles", {"num_vehicles": 30, "dt_s": 0.0001}, per_s=1.9e8),
    Size("rogue", "100 vehicles", {"num_vehicles": 100, "dt_s": 0.0005}, per_s=1.9e8),
)


def items(problems: list[Problem]) -> Iterator[Measurement]:
    """The sizes of some problems."""
    for problem in problems:
        for size in SIZES:
            if size.problem == problem.name:
                yield Measurement(PART, f"{problem.name} {size.name}", partial(_measure, problem, size))


def _measure(problem: Problem, size: Size, seconds: float, yardsticks: Yardsticks) -> Values:
    """An attacker's decision in a native vector environment against `none`, with actions of its own in each.

    Where illegal actions could end an episode, and on the calm road whose operations are counted, nobody acts.
    """
    assert problem.work is not None
    work = problem.work.per_game_step(problem.config("paper", size.overrides))
    if size.attack:
        per_s = work * _attacked(problem, size, seconds)
    else:
        game = problem.game(problem.config("paper", size.overrides), 1)
        work *= game.decision_interval["attacker"]
        options = {"preset": "paper", "opponent": OPPONENT, **size.overrides}
        step = vector(problem.env_id("attacker"), size.envs, neutral=size.operations > 0, **options)
        per_s = work * size.envs * (_late_calls_per_s(step) if size.late else calls_per_s(step, seconds))
    values = {
        "work_per_s": per_s,
        "substep_ns": 1e9 / per_s,
        "reached": per_s * limit_s(size, yardsticks),
        "step_us": 1e6 * work / per_s,
    }
    return values if size.attack else values | {"episode_kb": episode_kb(problem, size.overrides, size.many)}


def limit_s(size: Size, yardsticks: Yardsticks) -> float:
    """The least time of a substep's additions, products and comparisons, and divisions, in float64."""
    return size.operations / (OPERATIONS * yardsticks.updates_per_s) + size.divisions / yardsticks.divisions_per_s


def _late_calls_per_s(step: Call) -> float:
    """Calls per CPU second after a third of an episode of HVAC, once its window is full: the best of three parts."""
    parts = [microseconds(lambda: None, step, LATE_STEPS) for _ in range(5 + ROUNDS)]
    return 1e6 / min(parts[5:])


def _attacked(problem: Problem, size: Size, seconds: float) -> float:
    """Game steps of single episodes per CPU second, from 10 s after the start to the end."""
    everyone = np.ones(ENVS, np.bool_)
    match = problem.match(problem.config("paper", size.overrides), ENVS, {"attacker": size.attack})
    game = match.game
    before = round(10.0 / game.step_s)
    spent, best, rounds = 0.0, 0.0, 0
    while spent < seconds or rounds < ROUNDS:
        match.reset(everyone, seeded(range(ENVS)))
        match.step({}, everyone, before)
        start = process_time()
        game.advance({}, everyone, game.horizon - before)
        last = process_time() - start
        spent, best, rounds = spent + last, max(best, (game.horizon - before) * ENVS / last), rounds + 1
    return best


def episode_kb(problem: Problem, overrides: Mapping[str, Any], many: int = Size.many) -> float:
    """Memory of an environment of a batch, kB: what a batch of `many` takes beyond a batch of one, for each other."""
    _, few, all_of_them = (_traced(problem, overrides, envs) for envs in (FEW, FEW, many))  # the first loads kernels
    return (all_of_them - few) / (many - FEW) / 1e3


def _traced(problem: Problem, overrides: Mapping[str, Any], envs: int) -> int:
    tracemalloc.start()
    try:
        made: Any = gymnasium.make_vec(
            problem.env_id("attacker"), envs, "vector_entry_point", preset="paper", opponent=OPPONENT, **overrides
        )
        made.reset(seed=0)
        return tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
