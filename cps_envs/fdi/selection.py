"""Which tasks a configuration plays, and what is certified about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cps_envs.core.declare.objective import is_own
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import FloatArray
from cps_envs.fdi.config import TASK_GROUPS, FdiConfig
from cps_envs.fdi.optima import known, known_within
from cps_envs.fdi.task import Task

SIZES = {"single": (1,), "pairs": (2,), "feasible": (1, 2, 3, 4)}  # attacked sensors of the tasks of a group


class Certificates(NamedTuple):
    """What is known about each task (T,)."""

    bound: FloatArray  # no legal attack without defence is faster, m/s; 0 where nothing is certified
    value: FloatArray  # a legal plan attains it, m/s; 0 where none is known
    valid: FloatArray  # 1 where episodes of this configuration obey the bound


def chosen_tasks(config: FdiConfig) -> tuple[Task, ...]:
    """The tasks that resets draw from with equal probability; the fixed one where nothing is drawn.

    Raises:
        ConfigurationError: a group was asked for, and no feasible task is known with these constants.
    """
    if config.tasks not in TASK_GROUPS:
        return config.listed_tasks or (config.fixed_task,)
    sizes = SIZES[config.tasks]
    tasks = [task for task, record in known_within(config).items() if record.feasible and task.sensors.count in sizes]
    if not tasks:
        raise ConfigurationError(
            f"tasks = {config.tasks!r}: no feasible task is known with these constants and a horizon of "
            f"{config.horizon} steps. List tasks instead, such as tasks='x4>4 v1>1', or find feasible ones with "
            "`cps-envs certify`."
        )
    return tuple(tasks)


def certificates(config: FdiConfig, tasks: Sequence[Task]) -> Certificates:
    """The shipped certificates of the tasks.

    A bound holds in episodes that start in steady state with hard limits, without disturbance, and pay for the
    collision of the target pair; a defender who acts makes it a mere reference.
    """
    records, references = known(config), known_within(config)
    drawn = config.gap_spread_m > 0 or config.speed_spread_mps > 0 or config.gain_spread > 0
    paid = config.goal == "collision" and config.paid_pair == "target" and is_own(config)
    exact = config.limits == "hard" and paid and not drawn and not config.disturbed
    bounds = [records[task].bound_mps if task in records else 0.0 for task in tasks]
    values = [references[task].value_mps or 0.0 if task in references else 0.0 for task in tasks]
    valid = [float(exact and task in records) for task in tasks]
    return Certificates(np.array(bounds), np.array(values), np.array(valid))
