"""Values of the specification: trajectories, Tables 2.2 and 2.3. A change needs a new version of the environment."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.disbanding.state import State
from tests.disbanding.table_2_1 import CELLS, LEAD, TWO, Attack, metrics, run, run_heuristic, run_mpc, start, table_2_1

EARLY, LATE = 2e-6, 1e-4  # tolerances up to 30 s and later
FRONT_OF_WAVE = {55: (-327.5, 31.0, 0.0), 99: (-713.5, 31.0, 0.0)}

# case: interpretation, x_d, tau, attack, mitigation
CASES: dict[str, tuple[str, float, float, Attack, str]] = {
    "G1": ("S0", 5.0, 0.1, LEAD, "baseline"),
    "G2": ("S0", 5.0, 0.5, LEAD, "baseline"),
    "G3": ("S0", 5.0, 0.1, LEAD, "heuristic"),
    "G4": ("S0", 4.0, 0.3, LEAD, "mpc"),
    "G5": ("S0", 5.0, 0.1, TWO, "baseline"),
    "G6": ("S1", 4.0, 0.1, LEAD, "baseline"),
    "G7": ("S2", 5.0, 0.3, LEAD, "baseline"),
}

# (case, time in s, tolerance): {vehicle: (x, v, a)}
TRAJECTORIES = {
    ("G1", 2.0, EARLY): {
        9: (14.574500, 26.050000, -5.0),
        10: (-30.853592, 27.651287, -4.033200),
        55: (-420.5, 31.0, 0.0),
        99: (-806.5, 31.0, 0.0),
    },
    ("G1", 10.0, EARLY): {
        9: (94.642279, 3.662077, 0.274221),
        10: (74.604669, 5.922175, -0.165246),
        55: (-172.539039, 30.750876, -1.053339),
        99: (-558.5, 31.0, 0.0),
    },
    ("G1", 30.0, EARLY): {
        9: (292.808893, 17.289215, 0.728263),
        10: (272.447661, 16.322755, 0.710253),
        55: (0.978201, 0.040238, -0.011645),
        99: (-110.178312, 2.614300, -1.254982),
    },
    ("G1", 120.0, LATE): {
        9: (2743.100157, 28.812514, 0.004214),
        10: (2699.919158, 28.806051, 0.004235),
        55: (2167.160035, 36.0, 0.0),
        99: (970.148597, 36.0, 0.0),
    },
    ("G2", 5.0, EARLY): {
        9: (70.483277, 11.096211, -5.0),
        10: (33.667969, 14.876959, -4.330985),
        **FRONT_OF_WAVE,
    },
    ("G2", 30.0, EARLY): {
        9: (236.629292, 14.178090, 0.769121),
        10: (220.632652, 13.254137, 0.733480),
        55: (124.813066, 0.0, 0.0),
        99: (61.498590, 30.992933, -0.035457),
    },
    ("G3", 10.0, EARLY): {
        9: (94.642279, 3.662077, 0.274221),
        10: (51.367238, 3.668486, 0.133315),
        55: (-278.057354, 3.272811, -1.300751),
        99: (-609.354929, 9.446385, -4.114480),
    },
    ("G6", 10.0, EARLY): {
        9: (100.507873, 2.737260, 0.288730),
        10: (81.126309, 5.110792, -0.171043),
        55: (-123.944825, 27.200430, -4.999581),
        99: (-468.5, 31.0, 0.0),
    },
    ("G7", 10.0, 5e-5): {
        9: (100.1833, 2.8743, 0.0913),
        10: (79.8750, 5.3777, -0.3392),
        55: (-172.5, 31.0, 0.0),
        99: (-558.5, 31.0, 0.0),
    },
}

# case: (E_v intact, E_v all, vehicles collided, tolerance of E_v)
OUTCOMES = {
    "G1": (29.556830, 27.664138, 0, 1e-4),
    "G2": (51.275641, 47.256114, 82, 1e-4),
    "G3": (25.440854, 23.959759, 0, 1e-4),
    "G4": (25.10, 23.68, 0, 0.05),
    "G5": (44.419483, 39.168667, 0, 1e-4),
    "G6": (28.020560, 26.292313, 46, 1e-4),
}
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


def play(case: str, seconds: float) -> tuple[State, np.ndarray]:
    interpretation, desired_gap_m, tau_s, attack, mitigation = CASES[case]
    parameters = table_2_1(1, interpretation, desired_gap_m=desired_gap_m, tau_s=tau_s)
    state = start(parameters, attack)
    {"baseline": run, "heuristic": run_heuristic, "mpc": run_mpc}[mitigation](state, parameters, seconds)
    return state, parameters


@pytest.mark.parametrize(("case", "seconds", "tolerance"), TRAJECTORIES)
def test_trajectory(case: str, seconds: float, tolerance: float) -> None:
    state, _ = play(case, seconds)
    for vehicle, expected in TRAJECTORIES[case, seconds, tolerance].items():
        ours = [array[0, vehicle] for array in (state.position, state.speed, state.acceleration)]
        np.testing.assert_allclose(ours, expected, rtol=0.0, atol=tolerance, err_msg=f"vehicle {vehicle}")


@pytest.mark.parametrize("case", OUTCOMES)
def test_outcome(case: str) -> None:
    intact, everyone, collided, tolerance = OUTCOMES[case]
    ours = metrics(*play(case, 180.0))
    assert ours["velocity_error_intact"] == pytest.approx(intact, abs=tolerance)
    assert ours["velocity_error_all"] == pytest.approx(everyone, abs=tolerance)
    assert ours["collided"] == collided


def test_first_collisions() -> None:
    state, _ = play("G2", 5.5)
    assert state.first_collision_s[0] == pytest.approx(4.19)
    for desired_gap_m, tau_s, expected in ((5.0, 0.3, 5.75), (4.0, 0.3, 5.29), (5.0, 0.5, 4.19), (4.0, 0.5, 3.67)):
        parameters = table_2_1(desired_gap_m=desired_gap_m, tau_s=tau_s)
        state = start(parameters, LEAD)
        run(state, parameters, 6.0)
        assert state.first_collision_s[0] == pytest.approx(expected)


def test_rear_vehicles_collide_one_after_the_other() -> None:
    parameters = table_2_1(tau_s=0.5)
    state = start(parameters, LEAD)
    times: list[float] = []
    while len(times) < 3:
        before = int(state.rear_collided.sum())
        run(state, parameters, 0.01)
        times += [float(state.step[0]) * 0.01] * (int(state.rear_collided.sum()) - before)
    assert times[:3] == pytest.approx([4.19, 5.08, 5.45])


def cells(interpretation: str, mitigation: str, attack: Any) -> list[dict[str, float]]:
    """The metrics of the six cells, one environment each."""
    parameters = table_2_1(6, interpretation, desired_gap_m=[x for x, _ in CELLS], tau_s=[tau for _, tau in CELLS])
    state = start(parameters, attack)
    {"baseline": run, "heuristic": run_heuristic, "mpc": run_mpc}[mitigation](state, parameters, 180.0)
    return [metrics(state, parameters, b) for b in range(6)]


@pytest.mark.parametrize(("table", "interpretation", "mitigation"), ROWS)
def test_row(table: str, interpretation: str, mitigation: str) -> None:
    rows, attack, over = TABLES[table]
    expected, crashes = rows[interpretation, mitigation]
    ours = cells(interpretation, mitigation, attack)
    errors = [cell[f"velocity_error_{over}"] for cell in ours]
    np.testing.assert_allclose(errors, expected, rtol=0.0, atol=0.3 if mitigation == "mpc" else 0.05)
    assert "".join("Y" if cell["collided"] else "N" for cell in ours) == crashes


def test_intact_average_of_table_2_3() -> None:
    errors = [cell["velocity_error_intact"] for cell in cells("S0", "baseline", TWO)]
    np.testing.assert_allclose(errors, (44.4, 44.9, 55.1, 44.4, 46.2, 56.5), rtol=0.0, atol=0.06)


def test_counts_of_the_baseline() -> None:
    ours = cells("S0", "baseline", LEAD)
    assert [cell["collided"] for cell in ours] == [0, 64, 82, 0, 64, 82]
    assert [round(0.9 * cell["stopped_share"]) for cell in ours] == [50, 74, 87, 42, 76, 87]


@pytest.mark.parametrize(
    ("mitigation", "stopped"), [("heuristic", [46, 61, 81, 50, 71, 85]), ("mpc", [0, 0, 27, 0, 0, 78])]
)
def test_stops_under_mitigation(mitigation: str, stopped: list[int]) -> None:
    assert [round(0.9 * cell["stopped_share"]) for cell in cells("S0", mitigation, LEAD)] == stopped


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
