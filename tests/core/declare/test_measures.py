"""Every metric of every problem says what it is."""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, NamedTuple

import pytest

from cps_envs import PROBLEMS
from cps_envs.core.declare.measures import Measure, measures_of


class Counted(NamedTuple):
    speed: Annotated[float, Measure("m/s", "of the leader")]
    silent: float = 0.0


def test_a_measure_stands_beside_the_metric() -> None:
    assert measures_of(Counted) == {"speed": Measure("m/s", "of the leader")}


@pytest.mark.parametrize("problem", PROBLEMS)
def test_all_metrics_say_what_they_are(problem: str) -> None:
    module = import_module(f"cps_envs.{problem}.game")
    (game,) = (each for each in vars(module).values() if isinstance(each, type) and getattr(each, "measures", None))
    assert tuple(game.measures) == module.Metrics._fields
    assert all(each.says for each in game.measures.values())
