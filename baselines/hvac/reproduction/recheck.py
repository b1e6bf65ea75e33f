"""The condition under which chapter 4 is judged again: as many days of other seeds.

Its step of 120 s is printed, and the window, the horizon and the attacks count in it: half of it is another plant.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from baselines.hvac.reproduction.recording import Recorded
from baselines.hvac.reproduction.scenario import Scenario
from baselines.reproduction.evidence import Experiment
from baselines.reproduction.recheck import Condition

FIRST_SEED = 1000


def other_days(experiment: Experiment[Any]) -> Experiment[Any]:
    """The same under other seeds."""
    if isinstance(experiment, Scenario):
        return replace(experiment, first_seed=FIRST_SEED)
    if isinstance(experiment, Recorded):
        return replace(experiment, scenario=replace(experiment.scenario, first_seed=FIRST_SEED))
    raise TypeError(f"no claim needs {experiment.label}")


CONDITIONS = (Condition(f"over other days (seeds from {FIRST_SEED})", (other_days,)),)
