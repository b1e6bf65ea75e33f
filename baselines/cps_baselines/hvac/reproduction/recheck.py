"""The condition under which chapter 4 is judged again: days of other seeds, at least 20 where there are several.

Its step of 120 s is printed, and the window, the horizon and the attacks count in it: half of it is another plant.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cps_baselines.hvac.reproduction.recording import Recorded
from cps_baselines.hvac.reproduction.scenario import Scenario
from cps_baselines.reproduction.evidence import Experiment
from cps_baselines.reproduction.recheck import Condition

FIRST_SEED, FEWEST_DAYS = 1000, 20


def other_days(experiment: Experiment[Any]) -> Experiment[Any]:
    """The same under other seeds; a single day is one without noise."""
    if isinstance(experiment, Scenario):
        days = experiment.days if experiment.days == 1 else max(experiment.days, FEWEST_DAYS)
        return replace(experiment, first_seed=FIRST_SEED, days=days)
    if isinstance(experiment, Recorded):
        scenario = other_days(experiment.scenario)
        assert isinstance(scenario, Scenario)
        return replace(experiment, scenario=scenario)
    raise TypeError(f"no claim needs {experiment.label}")


CONDITIONS = (Condition(f"over other days (at least {FEWEST_DAYS}, seeds from {FIRST_SEED})", (other_days,)),)
