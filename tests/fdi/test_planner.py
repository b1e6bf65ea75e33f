"""The attacker that plans in its model: legal, better with more plans, and each episode by its own numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.family import find_family
from cps_baselines.fdi.planner import Planner
from cps_baselines.fdi.planning import Habits
from cps_envs.core.errors import ConfigurationError
from tests.fdi.episodes import play, spec_of

SPEC = spec_of("attacker", preset="drawn")
FAMILY = find_family("fdi-planner")
START = FAMILY.values(np.zeros((1, len(FAMILY.numbers))))
SEEDS = range(2_900_000, 2_900_012)


def test_its_numbers_are_its_habits() -> None:
    assert FAMILY.names == Habits._fields


def planner(first_plans: int, later_plans: int = 0) -> Planner:
    """The attacker with which a search begins, with so many plans."""
    return Planner(SPEC, START, first_plans=first_plans, later_plans=later_plans)


def paid(policy: Any, **settings: Any) -> Any:
    """The impact speeds (B,) in preset `drawn`."""
    outcome = play(policy, preset="drawn", seeds=SEEDS, **settings)
    assert not outcome["illegal"].any()
    return outcome["impact_speed_mps"]


def test_its_own_pair_collides_as_planned_and_more_plans_are_faster() -> None:
    tasks = "v1>1 x2>2 x4>4"
    few, more, again = (paid(planner(*plans), tasks=tasks).mean() for plans in ((0,), (600,), (600, 30)))
    assert few < more < again
    assert more > 3.0


def test_it_makes_two_pairs_collide_in_the_same_sample() -> None:
    assert (paid(planner(3000), tasks="x2>3 x2>4 v3>4") > 0).mean() >= 0.5


def test_with_drawn_gains_it_plans_by_those_of_the_episode() -> None:
    wide = paid(planner(300), tasks="v4>4", gain_spread=0.4)
    assert (wide > 0).all()


@pytest.mark.parametrize("preset", ["easy", "defense", "paper"])
def test_other_settings_are_refused(preset: Any) -> None:
    with pytest.raises(ConfigurationError, match='preset "drawn"'):
        FAMILY.build(spec_of("attacker", preset=preset), START)


def test_two_sensors_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="one attacked sensor"):
        FAMILY.build(spec_of("attacker", preset="drawn", tasks="xv4>4"), START)
