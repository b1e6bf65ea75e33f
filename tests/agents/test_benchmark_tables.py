"""What `cps-envs reproduce benchmark` plays of each problem, and what its tables show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cps_agents.arena.store import Store
from cps_envs.core.lookup import NEED_OPTIONS, policy_names
from cps_envs.core.types import ROLES
from cps_envs.fdi.optima import known
from cps_paper.benchmark.report import BenchmarkEntry, every_entry, grids, markdown, tables
from cps_paper.benchmark.schedule import Setting
from cps_paper.benchmark.suite import BenchmarkChoice, BenchmarkOutcome, find_benchmark, run_benchmark, select
from cps_paper.printed.tables import verdict

FDI, HVAC, ROGUE = (find_benchmark(name) for name in ("fdi", "hvac", "rogue"))
TASKS = [setting for setting in FDI.settings if setting.table is not None]
BEYOND = {  # what the maps of the dissertation show
    "attacker": {"beam", "contested", "gains", "identify", "probe", "strike", "tuned"},
    "defender": {"assigned", "box_in", "escort", "guard", "informed", "monitor", "pd_detection", "random"},
}


def day(setting: Setting, folder: Path) -> tuple[BenchmarkEntry, BenchmarkOutcome]:
    """The one meeting of a setting of the HVAC problem."""
    outcome = run_benchmark(replace(HVAC, settings=(setting,)), Store(folder), workers=1)
    (entry,) = every_entry(outcome)
    return entry, outcome


def hvac(name: str) -> Setting:
    return next(setting for setting in HVAC.settings if setting.name == name)


def test_tasks_of_false_data_are_columns_of_one_table(tmp_path: Path) -> None:
    (part,) = select([FDI], BenchmarkChoice(["x4-4", "x1-1"], ["none", "oracle", "bound"], quick=True))
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


def test_every_task_of_the_table_is_feasible_and_a_setting_of_its_own() -> None:
    names = [setting.name for setting in FDI.settings]
    assert len(set(names)) == len(names) == len(TASKS) + 1
    for config in (setting.venue.config for setting in TASKS):
        assert known(config)[config.fixed_task].feasible


@pytest.mark.slow
def test_no_attacker_exceeds_the_bound(tmp_path: Path) -> None:
    (part,) = select([FDI], BenchmarkChoice([setting.name for setting in TASKS]))
    outcome = run_benchmark(part, Store(tmp_path), workers=1)
    for result in (found for (found,) in outcome.played.results.values()):
        metrics = result["metrics"]
        assert max(metrics["impact_speed_mps"]) <= metrics["oracle_bound_mps"][0] + 1e-5


def test_every_table_of_hvac_has_the_defender_that_ignores_sensors() -> None:
    for setting in HVAC.settings:
        assert "model_only" in [defender.name for defender in setting.defenders], setting.name


def test_the_paper_s_number_of_hvac_is_reproduced(tmp_path: Path) -> None:
    entry, _ = day(replace(hvac("sensor-1"), defenders=hvac("sensor-1").defenders[:1]), tmp_path)
    assert entry.paper is not None
    assert entry.paper.value == 149.253
    assert entry.value == pytest.approx(149.253, rel=0.05)
    assert entry.verdict == verdict(entry.value - 149.253)


def test_cells_with_drawn_plants_show_median_and_quartiles(tmp_path: Path) -> None:
    full = hvac("easy")
    few = replace(full, attackers=full.attackers[:1], defenders=full.defenders[2:3], episodes=5)
    entry, outcome = day(few, tmp_path)
    found = sorted(outcome.result(("easy", entry.attacker, entry.defender))["metrics"]["a_impact"])
    assert entry.text == f"{found[2]:.1f}\n{found[1]:.1f} - {found[3]:.1f}"


def test_every_rogue_policy_of_the_paper_takes_part() -> None:
    named = {role: set(policy_names("rogue", role)) - {*NEED_OPTIONS} - BEYOND[role] for role in ROLES}
    for setting in ROGUE.settings:
        attackers = {contestant.reference.partition("?")[0] for contestant in setting.attackers}
        defenders = {contestant.reference for contestant in setting.defenders}
        assert attackers == named["attacker"]
        assert defenders == named["defender"] - {"none"}


@pytest.mark.parametrize("setting", [setting.name for setting in ROGUE.settings])
def test_a_rogue_meeting_shows_damage_and_tracking(setting: str, tmp_path: Path) -> None:
    wanted = BenchmarkChoice([setting], ["slow_square"], ["sliding_detection"], quick=True)
    outcome = run_benchmark(*select([ROGUE], wanted), Store(tmp_path), workers=1, quick=True)
    (entry,) = every_entry(outcome)
    assert entry.value == entry.means["damage"] > 0
    assert entry.crash
    damage, behind, cost = entry.text.split("\n")
    assert float(damage) == pytest.approx(entry.value, abs=0.05)
    assert behind == f"{entry.means['reference_error_m']:.0f} m"
    assert cost == f"c {entry.means['formation_cost_s']:.0f} s"
