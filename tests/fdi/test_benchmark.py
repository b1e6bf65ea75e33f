"""The declared benchmark: its tasks, its references, its tables."""

from __future__ import annotations

from pathlib import Path

import pytest

from cps_agents.arena.store import Store
from cps_agents.benchmark.matrix import grids
from cps_agents.benchmark.report import markdown, tables
from cps_agents.benchmark.suite import Choice, find_benchmark, run_benchmark, select
from cps_baselines.fdi.benchmark import BENCHMARK, TASKS
from cps_envs.core.lookup import resolve_policy
from cps_envs.fdi.optima import known
from cps_envs.fdi.payoff import Metrics
from tests.fdi.episodes import spec_of

LEAD = Choice(["x4-4", "x1-1"], ["none", "oracle", "bound"], quick=True)


def test_the_benchmark_is_found_and_its_contestants_exist() -> None:
    assert find_benchmark("fdi").problem == "fdi"
    for setting in BENCHMARK.settings:
        if setting.table is not None:
            config = setting.venue.config
            assert known(config)[config.fixed_task].feasible
            for contestant in setting.attackers:
                if contestant.reference.startswith("zoo:"):
                    continue  # `tests/agents/test_benchmark.py` plays those that are shipped
                spec = spec_of("attacker", preset=setting.venue.preset, **setting.venue.overrides)
                assert resolve_policy(contestant.reference, spec) is not None
        assert {setting.metric, setting.reference or setting.metric} <= set(Metrics._fields)


def test_tasks_are_columns_of_one_table(tmp_path: Path) -> None:
    (part,) = select([BENCHMARK], LEAD)
    outcome = run_benchmark(part, Store(tmp_path), workers=1)
    (grid,) = grids(outcome)
    assert grid.columns == ["x1>1", "x4>4"]
    assert grid.axis == "task"
    assert [heading for heading, _ in grid.rows] == ["none", "oracle", "certified bound"]
    assert len(tables(outcome)) == 1
    assert "| attacker | x1>1 | x4>4 |" in markdown(outcome)
    none, oracle, bound = (row for _, row in grid.rows)
    assert none[1].text == "0.00\n0%"
    assert oracle[1].text == "6.52\n100%"
    assert bound[1].value >= oracle[1].value
    for entry in oracle:
        assert entry.value == pytest.approx(entry.means["oracle_value_mps"], abs=1e-4)


def test_every_task_of_the_table_is_a_setting_of_its_own() -> None:
    names = [setting.name for setting in BENCHMARK.settings]
    assert len(set(names)) == len(names) == len(TASKS) + 1


@pytest.mark.slow
def test_no_attacker_exceeds_the_bound(tmp_path: Path) -> None:
    tasks = [setting.name for setting in BENCHMARK.settings if setting.table is not None]
    (part,) = select([BENCHMARK], Choice(tasks))
    outcome = run_benchmark(part, Store(tmp_path), workers=1)
    for result in (found for (found,) in outcome.played.results.values()):
        metrics = result["metrics"]
        assert max(metrics["impact_speed_mps"]) <= metrics["oracle_bound_mps"][0] + 1e-5
