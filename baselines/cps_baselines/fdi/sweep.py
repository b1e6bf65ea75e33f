"""The oracle over many tasks, several at a time, and over single episodes whose start and gains were drawn.

Both give certified impact speeds, for episodes without a defender.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from gymnasium.utils import seeding

from cps_baselines.fdi.continuation import Ending, from_state, program_to
from cps_baselines.fdi.cross import PROVED_MPS, cross, merged
from cps_baselines.fdi.highs import INFEASIBLE as SOLVER_INFEASIBLE
from cps_baselines.fdi.highs import Limits, Program, solve
from cps_baselines.fdi.lifted import lift
from cps_baselines.fdi.replay import NoReplayError, replay
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import FloatArray, IntArray
from cps_envs.fdi.config import FdiConfig
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.optima import INFEASIBLE, PROVED, TIME_LIMIT, Record
from cps_envs.fdi.sensors import Sensors
from cps_envs.fdi.task import Task, all_tasks

Run: TypeAlias = Callable[[Callable[[Any], Any], Sequence[Any]], Iterable[tuple[Any, Any]]]


def in_turn(function: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
    """Items with what `function` makes of them, one after the other."""
    for item in items:
        yield item, function(item)


def paper_tasks(num_vehicles: int) -> Sequence[Task]:
    """Every cell of Tables 3.1 to 3.6, or of Table 3.7 and its like: one or two vehicles attacked, every target."""
    return [*all_tasks(num_vehicles, 1), *all_tasks(num_vehicles, 2)]


def open_tasks(tasks: Iterable[Task], known: Mapping[Task, Record], *, improve: bool) -> list[Task]:
    """The tasks left to solve, few sensors first: those without a record, or also those that are not closed."""
    left = [task for task in tasks if task not in known or (improve and not known[task].closed)]
    return sorted(left, key=lambda task: task.sensors.count)


def sweep(
    config: FdiConfig,
    tasks: Sequence[Task],
    known: Mapping[Task, Record],
    *,
    time_limit_s: float = 20.0,
    gap: float = 0.0,
    run: Run = in_turn,
) -> Iterator[Record]:
    """Records of the tasks as they get done, merged with what is known already.

    A search begins with the best attack known for the task, or for fewer sensors and the same target: leaving a sensor
    alone is legal, so no task ends up below one of its parts that comes before it.

    Args:
        config: the platoon, its limits and the horizon.
        tasks: what to solve, in this order; neighbours with as many sensors side by side.
        known: earlier records.
        time_limit_s: of each integer program, s.
        gap: see `cross`.
        run: how the tasks of one size are done, such as `Workers.run` for several at a time.
    """
    found = dict(known)
    crossed = partial(_crossed, config, time_limit_s, gap)
    for _, alike in groupby(tasks, key=lambda task: task.sensors.count):
        work = [(task, best_start(task, found.values())) for task in alike]
        for (task, _), record in run(crossed, work):
            found[task] = merged(known[task], record) if task in known else record
            yield found[task]


def _crossed(config: FdiConfig, time_limit_s: float, gap: float, work: tuple[Task, IntArray | None]) -> Record:
    task, start = work
    return cross(config, task, time_limit_s, gap, start)


def best_start(task: Task, records: Iterable[Record]) -> IntArray | None:
    """The fastest known attack (m, q) on the target with these sensors or some of them; None if there is none."""
    best_mps, best = -1.0, None
    for record in records:
        fits = record.task.target == task.target and _within(record.task.sensors, task.sensors)
        if fits and record.value_mps is not None and record.value_mps > best_mps:
            best_mps, best = record.value_mps, record
    if best is None or best.injections is None:
        return None
    levels = np.zeros((len(best.injections), task.sensors.count), np.int64)
    levels[:, _places(best.task.sensors, task.sensors)] = best.injections
    return levels


def _within(part: Sensors, whole: Sensors) -> bool:
    return set(part.range) <= set(whole.range) and set(part.range_rate) <= set(whole.range_rate)


def _places(part: Sensors, whole: Sensors) -> list[int]:
    """Columns of the sensors of a part among those of the whole."""
    ranges = [whole.range.index(vehicle) for vehicle in part.range]
    return ranges + [len(whole.range) + whole.range_rate.index(vehicle) for vehicle in part.range_rate]


SHARE = 0.25  # of the time limit, for the programs of one number of steps


class Instance(NamedTuple):
    """One episode of preset `drawn`: the task, the start and the gains that its seed draws."""

    seed: int
    task: Task
    start: tuple[float, ...]  # e(0), (2n,) m and m/s
    gains: tuple[float, float]  # k_p in 1/s2 and k_d in 1/s


class Certificate(NamedTuple):
    """An instance, and what is known about it."""

    instance: Instance
    record: Record


def instance_of(config: FdiConfig, seed: int) -> Instance:
    """What the episode of a seed draws.

    Raises:
        ConfigurationError: nothing can be certified in this configuration.
    """
    if config.limits != "hard" or config.discretisation != "zohu" or config.disturbed or config.paid_pair != "target":
        raise ConfigurationError(
            'an episode can be certified with limits = "hard", discretisation = "zohu", paid_pair = "target" and no '
            'disturbance, as in preset "drawn"'
        )
    game = FdiGame(config, 1)
    game.reset(np.ones(1, np.bool_), [seeding.np_random(seed)[0]])
    task = game.tasks[game.state.task[0]]
    return Instance(seed, task, tuple(game.state.error[0].tolist()), game.gains(0))


def own_config(config: FdiConfig, instance: Instance) -> FdiConfig:
    """The configuration in which nothing is drawn and the gains are those of the instance."""
    gain_p, gain_d = instance.gains
    still = replace(config, tasks="", gap_spread_m=0.0, speed_spread_mps=0.0, gain_spread=0.0)
    return replace(still, proportional_gain=gain_p, derivative_gain=gain_d)


def crossing_from(config: FdiConfig, instance: Instance, steps: int, *, integer: bool) -> tuple[Program, float]:
    """Minimise e_v,t(steps) over legal injections that let the target collide then and nobody before.

    They begin at the start of the instance. The second value is what e_v,t(steps) has besides the program's objective.
    """
    sensors, pair, start = instance.task.sensors, instance.task.target - 1, np.array(instance.start)
    program = from_state(program_to(config, sensors, Ending(steps, pair)), start)
    whole = np.ones(len(program.cost), np.bool_) if integer else None
    return replace(program, integer=whole), float(
        lift(config, sensors).drift[steps, config.num_vehicles + pair] @ start
    )


def certify(config: FdiConfig, instance: Instance, time_limit_s: float = 20.0) -> Certificate:
    """The highest impact speed of an instance: over every number of steps to the collision, the fastest LPs first.

    Waiting is not free from a drawn start, so each number of steps has a program of its own. A number of steps whose
    LP is not above the best attack found needs no integer program.
    """
    began, own = time.perf_counter(), own_config(config, instance)
    tops: dict[int, float] = {}
    for steps in range(1, config.horizon + 1):
        program, drift = crossing_from(own, instance, steps, integer=False)
        found = solve(program)
        if found.status != SOLVER_INFEASIBLE:
            tops[steps] = max(0.0, -found.objective - drift)
    if not tops:
        record = Record(instance.task, None, None, 0.0, INFEASIBLE, time.perf_counter() - began)
        return Certificate(instance, record)
    lp_mps, best_mps, best = max(tops.values()), -1.0, None
    for steps in sorted(tops, key=lambda steps: -tops[steps]):
        left_s = time_limit_s - (time.perf_counter() - began)
        if tops[steps] <= best_mps + PROVED_MPS or left_s <= 0:
            break
        program, drift = crossing_from(own, instance, steps, integer=True)
        found = solve(program, Limits(min(left_s, SHARE * time_limit_s)))
        impossible = found.status == SOLVER_INFEASIBLE
        tops[steps] = 0.0 if impossible else min(tops[steps], max(0.0, -found.bound - drift))
        speed_mps, levels = _replayed(own, instance, found.columns)
        if speed_mps > best_mps:
            best_mps, best = speed_mps, levels
    bound_mps = max(best_mps, *tops.values())
    closed = bound_mps - best_mps <= PROVED_MPS
    status = INFEASIBLE if best is None and bound_mps == 0 else PROVED if closed else TIME_LIMIT
    value_mps = None if best is None else best_mps
    wall_s = time.perf_counter() - began
    return Certificate(instance, Record(instance.task, lp_mps, value_mps, bound_mps, status, wall_s, best))


def certify_all(
    config: FdiConfig, seeds: Sequence[int], *, time_limit_s: float = 20.0, run: Run = in_turn
) -> Iterator[Certificate]:
    """The certificates of the episodes of several seeds as they get done, see `sweep` for `run`."""
    instances = [instance_of(config, seed) for seed in seeds]
    for _, certificate in run(partial(certify, config, time_limit_s=time_limit_s), instances):
        yield certificate


def _replayed(config: FdiConfig, instance: Instance, point: FloatArray | None) -> tuple[float, IntArray | None]:
    """Speed and levels (k, q) of a solution that replays; -1 and None of any other."""
    if point is None:
        return -1.0, None
    levels: IntArray = np.rint(point).astype(np.int64).reshape(-1, instance.task.sensors.count)
    try:
        return replay(config, instance.task, levels, np.array(instance.start)), levels
    except NoReplayError:
        return -1.0, None
