"""The printed tables of chapter 4 and their readers."""

from __future__ import annotations

import pytest

from cps_baselines.paper.tables import TrackingErrorCell, read_table, tracking_errors
from cps_envs.core.errors import UnknownNameError


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


def test_an_unknown_table_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="table_4_1"):
        tracking_errors("4.3")


def test_claims_are_numbered_from_1_to_42() -> None:
    rows = read_table("claims_ch4")
    assert [row["id"] for row in rows] == [f"C{number:02d}" for number in range(1, 43)]
    assert all(row["claim"] and row["figure"] and row["unit"] for row in rows)
    assert all(row["paper_value"] == "yes" for row in rows if row["unit"] == "bool")
