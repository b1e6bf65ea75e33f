"""What the benchmark plays of the HVAC problem."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cps_agents.arena.store import Store
from cps_agents.benchmark.matrix import entries
from cps_agents.benchmark.suite import find_benchmark, run_benchmark
from cps_baselines.hvac.benchmark import BENCHMARK
from cps_baselines.paper.agreement import verdict
from cps_envs.core.lookup import resolve_policy
from cps_envs.hvac.problem import HVAC


def setting_of(name: str) -> Any:
    return next(setting for setting in BENCHMARK.settings if setting.name == name)


def test_it_is_found() -> None:
    assert find_benchmark("hvac").problem == "hvac"


def test_every_table_has_the_defender_that_ignores_sensors() -> None:
    for setting in BENCHMARK.settings:
        assert "model_only" in [defender.name for defender in setting.defenders], setting.name


@pytest.mark.parametrize("setting", BENCHMARK.settings, ids=lambda setting: setting.name)
def test_contestants_can_be_built(setting: str) -> None:
    game = HVAC.game(setting.venue.config, 1)
    for role, contestants in (("attacker", setting.attackers), ("defender", setting.defenders)):
        for contestant in (each for each in contestants if not each.reference.startswith("zoo:")):
            resolve_policy(contestant.reference, game.spec(role))


def test_the_paper_s_number_is_reproduced(tmp_path: Path) -> None:
    chosen = replace(setting_of("sensor-1"), defenders=setting_of("sensor-1").defenders[:1])
    outcome = run_benchmark(replace(BENCHMARK, settings=(chosen,)), Store(tmp_path), workers=1)
    ((entry,),) = entries(outcome, chosen)
    assert entry.paper is not None
    assert entry.paper.value == 149.253
    assert entry.value == pytest.approx(149.253, rel=0.05)
    assert entry.verdict == verdict(entry.value - 149.253)


def test_cells_with_drawn_plants_show_median_and_quartiles(tmp_path: Path) -> None:
    full = setting_of("easy")
    chosen = replace(full, attackers=full.attackers[:1], defenders=full.defenders[2:3], episodes=5)
    outcome = run_benchmark(replace(BENCHMARK, settings=(chosen,)), Store(tmp_path), workers=1)
    ((entry,),) = entries(outcome, chosen)
    found = sorted(outcome.result((chosen.name, entry.attacker, entry.defender))["metrics"]["a_impact"])
    assert entry.text == f"{found[2]:.1f}\n{found[1]:.1f} - {found[3]:.1f}"
