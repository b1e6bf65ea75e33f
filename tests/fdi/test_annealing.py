"""Better attacks by annealing, judged by a replay and by what is proved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cps_baselines.fdi.annealing import anneal
from cps_baselines.fdi.replay import NoReplayError, replay
from cps_envs.fdi.config import CLIP, A, FdiConfig
from cps_envs.fdi.optima import known
from cps_envs.fdi.task import parse_task

PLANS = 20_000


@pytest.mark.parametrize(
    ("config", "name"), [(A, "v1,3>1"), (A, "xv2,4>3"), (CLIP, "x1,3>2"), (replace(A, num_vehicles=5), "v4>4")]
)
def test_plans_stay_legal_and_are_no_slower(config: FdiConfig, name: str) -> None:
    task = parse_task(name, config.num_vehicles)
    found = anneal(config, task, None, PLANS)
    if found is not None:
        assert found.shape == (config.horizon, task.sensors.count)
        speed_mps = replay(config, task, found)  # raises where it is not legal
        again = anneal(config, task, found, PLANS, seed=1)
        assert again is not None
        assert replay(config, task, again) >= speed_mps
        if task in known(config):
            assert speed_mps <= known(config)[task].bound_mps + 1e-6


def test_the_same_seed_finds_the_same() -> None:
    task = parse_task("x4>4", 4)
    first, second = (anneal(A, task, known(A)[task].injections, 2000, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_spoilt_optimum_is_mended() -> None:
    task = parse_task("v4>4", 4)
    optimum = known(A)[task]
    assert optimum.injections is not None
    spoilt = optimum.injections.copy()
    spoilt[1:3] += 2
    with pytest.raises(NoReplayError):
        replay(A, task, spoilt)
    found = anneal(A, task, spoilt, PLANS)
    assert found is not None
    assert replay(A, task, found) > 0.9 * (optimum.value_mps or 0.0)


def test_nothing_is_found_where_nothing_is_possible() -> None:
    assert anneal(A, parse_task("x4>1", 4), None, 1000) is None
