"""Tables 2.2 and 2.3 as the reference implementation of the specification computes them (6.2, 6.3)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.disbanding.table_2_1 import CELLS, LEAD, TWO, metrics, run, run_heuristic, run_mpc, start, table_2_1

Row = tuple[float, ...]

# (interpretation, mitigation): E_v over the intact vehicles in percent and crash flags, cells in the order of CELLS
TABLE_2_2: dict[tuple[str, str], tuple[Row, str]] = {
    ("S0", "baseline"): ((29.56, 37.68, 51.28, 28.98, 39.02, 52.64), "NYYNYY"),
    ("S1", "baseline"): ((29.36, 38.36, 52.30, 28.02, 40.51, 53.20), "NYYYYY"),
    ("S2", "baseline"): ((29.26, 39.77, 50.58, 29.17, 40.30, 50.86), "YYYYYY"),
    ("S0", "heuristic"): ((25.44, 26.82, 28.74, 26.21, 27.70, 29.35), "NNNNNN"),
    ("S1", "heuristic"): ((25.50, 27.49, 28.92, 26.36, 28.11, 29.62), "NNNNNN"),
    ("S0", "mpc"): ((21.97, 24.34, 28.55, 22.59, 25.10, 29.22), "NNNNNN"),
    ("S1", "mpc"): ((22.03, 24.58, 28.61, 22.69, 25.35, 29.26), "NNNNNN"),
}
# E_v over all vehicles
TABLE_2_3: dict[tuple[str, str], tuple[Row, str]] = {
    ("S0", "baseline"): ((39.17, 39.81, 48.08, 39.17, 41.02, 49.30), "NYYNYY"),
    ("S1", "baseline"): ((39.09, 39.54, 48.98, 38.41, 40.90, 49.78), "NYYYYY"),
    ("S2", "baseline"): ((38.40, 40.70, 49.50, 38.77, 43.42, 49.79), "YYYYYY"),
    ("S0", "heuristic"): ((33.28, 34.42, 37.19, 34.15, 35.31, 38.12), "NNNNNY"),
    ("S1", "heuristic"): ((33.03, 34.75, 37.35, 33.89, 35.68, 38.35), "NNYNNY"),
    ("S0", "mpc"): ((31.08, 32.81, 35.01, 31.90, 33.76, 35.95), "NNNNNN"),
}
TABLES: dict[str, Any] = {"2.2": (TABLE_2_2, LEAD, "intact"), "2.3": (TABLE_2_3, TWO, "all")}
ROWS = [(table, *row) for table, (rows, _, _) in TABLES.items() for row in rows]


def play(interpretation: str, mitigation: str, attack: Any) -> list[dict[str, float]]:
    """The metrics of the six cells, one environment each."""
    parameters = table_2_1(6, interpretation, desired_gap_m=[x for x, _ in CELLS], tau_s=[tau for _, tau in CELLS])
    state = start(parameters, attack)
    {"baseline": run, "heuristic": run_heuristic, "mpc": run_mpc}[mitigation](state, parameters, 180.0)
    return [metrics(state, parameters, b) for b in range(6)]


@pytest.mark.parametrize(("table", "interpretation", "mitigation"), ROWS)
def test_row(table: str, interpretation: str, mitigation: str) -> None:
    rows, attack, over = TABLES[table]
    expected, crashes = rows[interpretation, mitigation]
    ours = play(interpretation, mitigation, attack)
    errors = [cell[f"velocity_error_{over}"] for cell in ours]
    np.testing.assert_allclose(errors, expected, rtol=0.0, atol=0.3 if mitigation == "mpc" else 0.05)
    assert "".join("Y" if cell["collided"] else "N" for cell in ours) == crashes


def test_intact_average_of_table_2_3() -> None:
    errors = [cell["velocity_error_intact"] for cell in play("S0", "baseline", TWO)]
    np.testing.assert_allclose(errors, (44.4, 44.9, 55.1, 44.4, 46.2, 56.5), rtol=0.0, atol=0.06)


def test_counts_of_the_baseline() -> None:
    ours = play("S0", "baseline", LEAD)
    assert [cell["collided"] for cell in ours] == [0, 64, 82, 0, 64, 82]
    assert [round(0.9 * cell["stopped_share"]) for cell in ours] == [50, 74, 87, 42, 76, 87]


@pytest.mark.parametrize(
    ("mitigation", "stopped"), [("heuristic", [46, 61, 81, 50, 71, 85]), ("mpc", [0, 0, 27, 0, 0, 78])]
)
def test_stops_under_mitigation(mitigation: str, stopped: list[int]) -> None:
    assert [round(0.9 * cell["stopped_share"]) for cell in play("S0", mitigation, LEAD)] == stopped


@pytest.mark.parametrize(
    ("tau_s", "expected"),
    [
        (0.1, (18.86, 19.46, 20.60, 21.97, 23.48, 25.07, 26.69, 28.17, 29.56)),
        (0.3, (20.86, 23.25, 26.16, 28.90, 31.09, 32.96, 34.64, 36.20, 37.68)),
        (0.5, (23.36, 27.64, 32.08, 35.72, 39.03, 42.19, 45.25, 48.26, 51.28)),
    ],
)
def test_error_grows_with_the_number_of_platoons(tau_s: float, expected: Row) -> None:
    """Figure 2.3c, claim P25; one environment for N = 2..10, the absent vehicles at the rear."""
    platoons = np.arange(2, 11)
    parameters = table_2_1(9, tau_s=tau_s, num_vehicles=10 * platoons)
    state = start(parameters)
    state.disbanding_s[:, 0] = 1.0
    run(state, parameters, 180.0)
    errors = []
    for b, count in enumerate(platoons):
        state.disbanding_s[b, count:] = np.inf
        errors.append(metrics(state, parameters, b)["velocity_error_intact"])
    np.testing.assert_allclose(errors, expected, rtol=0.0, atol=0.0051)
