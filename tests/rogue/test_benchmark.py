"""What `cps-envs benchmark` plays of the rogue-vehicle problem."""

from __future__ import annotations

from pathlib import Path

import pytest

from agents.benchmark.matrix import entries
from agents.benchmark.runner import find_benchmarks, run_benchmark, select
from agents.benchmark.store import Store
from baselines.rogue.benchmark import BENCHMARK
from cps_envs.core.lookup import NEED_OPTIONS, policy_names


def test_every_registered_policy_takes_part() -> None:
    assert [found.problem for found in find_benchmarks(["rogue"])] == ["rogue"]
    for setting in BENCHMARK.settings:
        attackers = {entrant.reference.partition("?")[0] for entrant in setting.attackers}
        defenders = {entrant.reference for entrant in setting.defenders}
        assert attackers == set(policy_names("rogue", "attacker")) - {*NEED_OPTIONS} | {"zoo:rogue-attack-ppo"}
        assert defenders == set(policy_names("rogue", "defender")) - {"none", *NEED_OPTIONS} | {"zoo:rogue-defense-ppo"}


@pytest.mark.parametrize("setting", [setting.name for setting in BENCHMARK.settings])
def test_a_meeting_shows_damage_and_tracking(setting: str, tmp_path: Path) -> None:
    wanted = {"setting": [setting], "attacker": ["slow_square"], "defender": ["sliding_detection"]}
    outcome = run_benchmark(select(BENCHMARK, wanted, quick=True), Store(tmp_path), workers=1, quick=True)
    ((entry,),) = entries(outcome, outcome.benchmark.settings[0])
    assert entry.value == entry.means["damage"] > 0
    assert entry.crash
    damage, behind, cost = entry.text.split("\n")
    assert float(damage) == pytest.approx(entry.value, abs=0.05)
    assert behind == f"{entry.means['reference_error_m']:.0f} m"
    assert cost == f"c {entry.means['formation_cost_s']:.0f} s"
