"""What `cps-envs reproduce benchmark` plays of each problem, and what its tables show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cps_agents.arena.store import Store
from cps_agents.arena.table import Table
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.types import ROLES, Role
from cps_envs.fdi.optima import known
from cps_paper.benchmark.report import BenchmarkEntry, entries, every_entry, markdown, tables
from cps_paper.benchmark.suite import BenchmarkOutcome, find_benchmark, run_benchmark, select
from cps_paper.printed.tables import verdict

FDI, HVAC, ROGUE = (find_benchmark(name) for name in ("fdi", "hvac", "rogue"))
(TASKS,) = (table for table in FDI.tables if table.name == "tasks")
OF_CHAPTER_5 = ("paper-1", "paper-1.3", "solid-1", "solid-1.3", "easy")  # tables
CHAPTER_5: dict[Role, set[str]] = {
    "attacker": {"none", "square", "duty_square", "random", "switching"},
    "defender": {"pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7"},
}


def day(table: Table, folder: Path) -> tuple[BenchmarkEntry, BenchmarkOutcome]:
    """The one meeting of a table of the HVAC problem."""
    outcome = run_benchmark(replace(HVAC, tables=(table,)), Store(folder), workers=1)
    (entry,) = every_entry(outcome)
    return entry, outcome


def hvac(name: str) -> Table:
    return next(table for table in HVAC.tables if table.name == name)


def test_tasks_of_false_data_are_columns_of_one_table(tmp_path: Path) -> None:
    (part,) = select([FDI], attackers=["none", "oracle", "bound"], defenders=["x4-4", "x1-1"], quick=True)
    outcome = run_benchmark(part, Store(tmp_path), workers=1)
    (sheet,) = tables(outcome)
    assert sheet.columns == ["attacker", "x1>1", "x4>4"]
    assert [row[0] for row in sheet.rows] == ["none", "oracle", "certified bound"]
    assert "| attacker | x1>1 | x4>4 |" in markdown(outcome)
    none, oracle, bound = entries(outcome, 0)
    assert none[1].text == "0.00\n0%"
    assert oracle[1].text == "6.52\n100%"
    assert bound[1].value >= oracle[1].value
    for entry in oracle:
        assert entry.value == pytest.approx(entry.means["oracle_value_mps"], abs=1e-4)


def test_every_task_of_the_table_is_feasible_and_a_column_of_its_own() -> None:
    names = [column.name for column in TASKS.defenders]
    assert len(set(names)) == len(names) == 9
    for place, column in enumerate(TASKS.defenders):
        config = TASKS.meeting((0, place)).venue.config
        assert str(config.fixed_task) == column.title
        assert known(config)[config.fixed_task].feasible


@pytest.mark.slow
def test_no_attacker_exceeds_the_bound(tmp_path: Path) -> None:
    (part,) = select([FDI], tables=[TASKS.name])
    outcome = run_benchmark(part, Store(tmp_path), workers=1)
    for result in (found for (found,) in outcome.played.results.values()):
        metrics = result["metrics"]
        assert max(metrics["impact_speed_mps"]) <= metrics["oracle_bound_mps"][0] + 1e-5


def test_every_table_of_hvac_has_the_defender_that_ignores_sensors() -> None:
    for table in HVAC.tables:
        assert "model_only" in [defender.name for defender in table.defenders], table.name


def test_the_paper_s_number_of_hvac_is_reproduced(tmp_path: Path) -> None:
    (cell,) = (each for each in HVAC.paper if each.table == "sensor-1")
    (part,) = select([HVAC], tables=[cell.table], attackers=[cell.attacker], defenders=[cell.defender])
    (entry,) = every_entry(run_benchmark(part, Store(tmp_path), workers=1))
    assert entry.paper == cell
    assert cell.value == 149.253
    assert entry.value == pytest.approx(149.253, rel=0.05)
    assert entry.verdict == verdict(entry.value - 149.253)


def test_cells_with_drawn_plants_show_median_and_quartiles(tmp_path: Path) -> None:
    full = hvac("easy")
    few = replace(full, attackers=full.attackers[:1], defenders=full.defenders[2:3], episodes=5)
    entry, _ = day(few, tmp_path)
    found = sorted(entry.metrics["a_impact"])
    assert entry.text == f"{found[2]:.1f}\n{found[1]:.1f} - {found[3]:.1f}"


def test_every_rogue_policy_of_the_paper_takes_part() -> None:
    tables = {table.name: table for table in ROGUE.tables}
    for name in OF_CHAPTER_5:
        for role in ROLES:
            assert {each.reference.partition("?")[0] for each in tables[name].players(role)} >= CHAPTER_5[role]


@pytest.mark.parametrize(
    ("change", "remedy"),
    [
        ({"metric": "damge"}, r"'easy' has no metric 'damge'. Did you mean 'damage'"),
        ({"form": "{valu:.1f}"}, r"'easy': `form` shows 'valu'. Did you mean 'value'"),
    ],
)
def test_a_misspelt_number_of_a_table_is_named(change: dict[str, str], remedy: str, tmp_path: Path) -> None:
    (part,) = select([ROGUE], tables=["easy"], attackers=["none"], defenders=["pd"], quick=True)
    with pytest.raises(UnknownNameError, match=remedy):
        run_benchmark(replace(part, tables=(replace(part.tables[0], **change),)), Store(tmp_path), workers=1)
    assert not list(tmp_path.iterdir())  # nothing was played


def test_equal_names_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="2 tables of the benchmark of fdi are called 'tasks'"):
        replace(FDI, tables=(TASKS, TASKS))
    with pytest.raises(ConfigurationError, match="2 defenders of table 'tasks' are called "):
        replace(FDI, tables=(replace(TASKS, defenders=(TASKS.defenders[0],) * 2),))


@pytest.mark.parametrize("table", ["solid-1.3", "easy"])
def test_a_rogue_meeting_shows_damage_and_tracking(table: str, tmp_path: Path) -> None:
    names = {"tables": [table], "attackers": ["slow_square"], "defenders": ["sliding_detection"]}
    outcome = run_benchmark(*select([ROGUE], **names, quick=True), Store(tmp_path), workers=1)
    (entry,) = every_entry(outcome)
    assert entry.value == entry.means["damage"] > 0
    assert entry.crash
    damage, behind, cost = entry.text.split("\n")
    assert float(damage) == pytest.approx(entry.value, abs=0.05)
    assert behind == f"{entry.means['reference_error_m']:.0f} m"
    assert cost == f"c {entry.means['formation_cost_s']:.0f} s"
