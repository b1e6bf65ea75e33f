"""The printed tables as shipped: their cells, their readers, and what they say without solving anything."""

from __future__ import annotations

import pytest

from cps_envs.core.errors import UnknownNameError
from cps_envs.fdi.task import all_tasks, make_task
from cps_paper.fdi.audit import SensorComparison, comparisons, worst
from cps_paper.fdi.controls import control_tables
from cps_paper.fdi.experiments import ALL_FOUR, FOUR_VEHICLES, TABLES, FdiEvidence
from cps_paper.printed.tables import (
    CollisionCell,
    TrackingErrorCell,
    collision_cells,
    collision_runs,
    read_table,
    tracking_errors,
)


@pytest.fixture(scope="module")
def cells() -> dict[str, list[CollisionCell]]:
    return {table: collision_cells(table) for table in TABLES}


def cell(cells: dict[str, list[CollisionCell]], table: str, attacked: str, target: int) -> CollisionCell:
    task = make_task(attacked, target, 5 if table == "3.7" else 4)
    (found,) = (each for each in cells[table] if each.task == task)
    return found


def test_counts_of_cells(cells: dict[str, list[CollisionCell]]) -> None:
    every = [each for members in cells.values() for each in members]
    assert (len(every), sum(each.feasible for each in every), sum(len(each.pairs) for each in every)) == (170, 89, 125)
    assert [len(cells[table]) for table in TABLES] == [16, 16, 24, 24, 16, 24, 50]
    assert sum(each.feasible for each in cells["3.7"]) == 23


def test_every_task_stands_in_one_cell(cells: dict[str, list[CollisionCell]]) -> None:
    printed = [each.task for table in FOUR_VEHICLES for each in cells[table]]
    assert set(printed) == {*all_tasks(4, 1), *all_tasks(4, 2)}
    assert len(set(printed)) == len(printed)


def test_targets_of_feasible_cells_are_listed(cells: dict[str, list[CollisionCell]]) -> None:
    for members in cells.values():
        for each in members:
            assert (each.target_speed_mps is not None) == each.feasible == bool(each.pairs)
            assert list(each.pairs) == sorted(set(each.pairs))
            assert all(speed < 0 for _, speed in each.speeds_mps)


def test_speeds_belong_to_their_pairs(cells: dict[str, list[CollisionCell]]) -> None:
    assert cell(cells, "3.1", "x3", 4).speeds_mps == ((3, -1.848), (4, -2.003))
    assert cell(cells, "3.1", "x3", 4).target_speed_mps == -2.003
    assert cell(cells, "3.1", "x1", 1).target_speed_mps == -1.995
    assert cell(cells, "3.6", "xv34", 4).target_speed_mps is None
    assert cell(cells, "3.4", "v12", 2).name == "v1,2 -> V_2"


def test_figure_3_2() -> None:
    first, second = collision_runs()
    assert (str(first.sensors), first.time_s, first.impact_speed_mps) == ("x10", 28.0, -3.5)
    assert (str(second.sensors), second.time_s, second.impact_speed_mps) == ("xv10", 11.8, -6.0)
    assert first.pair == second.pair == 9


def test_unknown_tables_are_named() -> None:
    with pytest.raises(UnknownNameError, match="table_3_8"):
        read_table("table_3_8")
    with pytest.raises(UnknownNameError, match="table_3_8"):
        collision_cells("3.8")
    with pytest.raises(UnknownNameError, match="table_4_1"):
        tracking_errors("4.3")


def test_audit() -> None:
    found = comparisons()
    assert len(found) == 133
    assert sum(each.contradiction for each in found) == 75


def test_the_rule_of_ten_percent() -> None:
    first, second = (make_task(text, 1, 4) for text in ("x1", "xv1"))
    for speed, contradiction in ((-3.7, False), (-3.5, True), (-5.0, False)):
        found = SensorComparison(CollisionCell("3.1", first, ((1, -4.0),)), CollisionCell("3.5", second, ((1, speed),)))
        assert found.contradiction is contradiction
    vanished = SensorComparison(CollisionCell("3.1", first, ((1, -4.0),)), CollisionCell("3.5", second, ()))
    assert vanished.contradiction
    assert vanished.drop_mps == 4.0


def test_the_worst_come_first() -> None:
    drops = [each.drop_mps for each in worst(comparisons(), 8)]
    assert drops == sorted(drops, reverse=True)
    assert drops[0] == pytest.approx(8.270)


def test_rule_of_the_attacked_target() -> None:
    found = {each.table: each for each in control_tables(FdiEvidence({}), TABLES)}
    expected = {"3.1": 15, "3.2": 14, "3.3": 16, "3.4": 18, "3.5": 14, "3.6": 17, "3.7": 45, ALL_FOUR: 94}
    assert {table: each.target_attacked for table, each in found.items()} == expected
    assert {table: each.cells for table, each in found.items()}[ALL_FOUR] == 120
    assert found["3.1"].relaxed is None
    assert found["3.1"].fast_attack == 15


@pytest.mark.parametrize(("table", "percents"), [("4.1", (20, 40, 60, 80)), ("4.2", (2, 5, 10, 30))])
def test_every_condition_has_five_sources_and_four_zones(table: str, percents: tuple[int, ...]) -> None:
    cells = tracking_errors(table)
    expected = [(percent, used, zone) for percent in percents for used in range(5) for zone in range(1, 5)]
    assert [(cell.percent, cell.sensors_used, cell.zone) for cell in cells] == expected
    assert all(0.0 < cell.mean_abs_error_c < 5.0 for cell in cells)


@pytest.mark.parametrize(
    "cell",
    [
        TrackingErrorCell("4.1", 20, 0, 1, 0.524),
        TrackingErrorCell("4.1", 80, 0, 4, 3.992),
        TrackingErrorCell("4.1", 40, 3, 3, 0.321),
        TrackingErrorCell("4.2", 5, 1, 1, 0.676),
        TrackingErrorCell("4.2", 30, 4, 4, 1.135),
    ],
)
def test_cells_are_those_that_are_printed(cell: TrackingErrorCell) -> None:
    assert cell in tracking_errors(cell.table)
