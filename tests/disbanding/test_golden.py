"""Golden values of the specification, 6.8: any change of a number needs a new version of the environment."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs.disbanding.state import State
from tests.disbanding.table_2_1 import LEAD, TWO, Attack, metrics, run, run_heuristic, run_mpc, start, table_2_1

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
