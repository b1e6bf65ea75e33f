from __future__ import annotations

import numpy as np
import pytest

from cps_envs.disbanding.config import INTERPRETATIONS
from cps_envs.disbanding.start import place, undisturbed
from cps_envs.disbanding.state import State, allocate
from tests.disbanding.table_2_1 import CELLS, LEAD, law_commands, metrics, run, start, steps, table_2_1


def assert_same(ours: State, theirs: State) -> None:
    """All arrays are equal, bit for bit."""
    for name in State._fields:
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=name)


@pytest.mark.parametrize("interpretation", INTERPRETATIONS)
def test_steady_state_stays(interpretation: str) -> None:
    parameters = table_2_1(6, interpretation, desired_gap_m=[x for x, _ in CELLS], tau_s=[tau for _, tau in CELLS])
    state = start(parameters)
    gaps = -np.diff(state.position)
    run(state, parameters, 180.0)
    np.testing.assert_allclose(state.speed, 31.0, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(-np.diff(state.position), gaps, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("size", [0.0, 0.0499])
def test_corrections_within_the_dead_band_change_nothing(size: float) -> None:
    parameters = table_2_1(tau_s=0.5)
    plain, corrected = start(parameters, LEAD), start(parameters, LEAD)
    run(plain, parameters, 60.0)
    run(corrected, parameters, 60.0, np.full((1, 100), -size))
    assert_same(corrected, plain)


def test_corrections_act_on_mitigable_vehicles_only() -> None:
    """With the middle platoon disbanded, only the vehicles behind it obey; nobody does before."""
    parameters = table_2_1()
    plain, corrected = (start(parameters, ((5, 1.0),)) for _ in range(2))
    correction = np.full((1, 100), -1.0)
    run(plain, parameters, 1.0)
    run(corrected, parameters, 1.0, correction)
    assert_same(corrected, plain)
    expected = [False] * 60 + [True] * 40
    run(plain, parameters, 0.01)
    run(corrected, parameters, 0.01, correction)
    assert (plain.command != corrected.command)[0].tolist() == expected


def test_a_correction_adds_to_the_clipped_law_and_is_not_clipped_again() -> None:
    parameters = table_2_1()
    state = start(parameters, LEAD)
    run(state, parameters, 8.0)
    law = law_commands(state, parameters)
    run(state, parameters, 0.01, np.full((1, 100), 6.0))
    free = np.arange(100) >= 10
    free &= state.command[0] != -5.0
    assert free.sum() > 30
    np.testing.assert_array_equal(state.command[0, free], np.clip(law[0, free], -5.0, 1.0) + 6.0)


def test_drivers_take_over_after_their_delay() -> None:
    parameters = table_2_1()
    delays = np.zeros((1, 100))
    delays[0, 5] = 0.5
    state = start(parameters, LEAD, takeover_delay_s=delays)
    late = start(parameters, LEAD, takeover_delay_s=delays + 0.5)
    run(state, parameters, 1.01)
    run(late, parameters, 1.01)
    braking = np.flatnonzero(state.command[0] < -1.0).tolist()
    assert braking == [1, 2, 3, 4, 6, 7, 8, 9]
    assert np.abs(late.command).max() < 1e-9


def test_fewer_vehicles_than_the_arrays_hold() -> None:
    small, wide = table_2_1(num_vehicles=60, tau_s=0.5), table_2_1(num_vehicles=60, tau_s=0.5)
    few, many = start(small, (), 6), start(wide, (), 10)
    few.disbanding_s[:, 0] = many.disbanding_s[:, 0] = 1.0
    absent = {name: getattr(many, name)[:, 60:].copy() for name in ("position", "speed", "moving", "previous_gap")}
    run(few, small, 60.0)
    run(many, wide, 60.0)
    for name in ("position", "speed", "acceleration", "command", "speed_error", "stops", "rear_collided", "collided"):
        np.testing.assert_array_equal(getattr(few, name), getattr(many, name)[:, :60], err_msg=name)
    for name, before in absent.items():
        np.testing.assert_array_equal(getattr(many, name)[:, 60:], before, err_msg=name)
    assert few.intact_error[0] == many.intact_error[0]
    many.disbanding_s[:, 6:] = few.disbanding_s[0, 1]
    assert metrics(few, small) == metrics(many, wide)


def test_an_environment_may_end_with_the_first_collision_of_an_intact_vehicle() -> None:
    parameters = table_2_1(2, tau_s=[0.5, 0.1], stop_at_collision=True)
    state = start(parameters, LEAD)
    for _ in range(3):
        run(state, parameters, 4.0)
    assert state.step.tolist() == [419, 1200]
    assert state.collided_intact.sum(axis=1).tolist() == [2, 0]


def test_collisions_within_a_disbanded_platoon_do_not_count_as_intact() -> None:
    parameters = table_2_1(tau_s=0.5, stop_at_collision=True)
    delays = np.zeros((1, 100))
    delays[0, 6] = 30.0
    state = start(parameters, LEAD, takeover_delay_s=delays, driver_headway_s=np.full((1, 100), 0.3))
    state.position[0, 6:] += 5.5  # vehicle 6 is in front of its predecessor when the attack begins
    state.disbanding_s[0, 0] = 0.0
    run(state, parameters, 0.01)
    assert state.collided[0].nonzero()[0].tolist() == [5, 6]
    assert not state.collided_intact.any()
    assert state.first_collision_s[0] == pytest.approx(0.01)
    run(state, parameters, 1.0)
    assert state.step[0] > 1


@pytest.mark.slow
def test_holding_the_speed_does_not_pay() -> None:
    """Section 7.3: because (2.6) acts last, nobody drives through the stopped platoon unharmed.

    Five steps share a correction here, of which the expected numbers had one for each.
    """
    parameters = table_2_1(3, tau_s=[0.1, 0.3, 0.5])
    state = start(parameters, LEAD)
    for _ in range(steps(parameters, 180.0) // 5):
        law = law_commands(state, parameters)
        wanted = np.clip(parameters["derivative_gain"][0] * (31.0 - state.speed), -5.0, 1.0)
        run(state, parameters, 0.05, wanted - np.clip(law, -5.0, 1.0))
    for b, expected in enumerate((51.8, 62.9, 64.4)):
        ours = metrics(state, parameters, b)
        assert ours["velocity_error_intact"] > 50.0
        assert ours["velocity_error_intact"] == pytest.approx(expected, abs=1.0)
        assert ours["collided_intact"] == 90


def test_place_touches_the_given_environments_only_and_clears_them() -> None:
    parameters = table_2_1(2)
    state = start(parameters, LEAD)
    run(state, parameters, 10.0)
    before = State(*(array.copy() for array in state))
    place(state, parameters, undisturbed(parameters, 100), np.array([False, True]))
    fresh = start(parameters)
    for name in State._fields:
        np.testing.assert_array_equal(getattr(state, name)[0], getattr(before, name)[0], err_msg=name)
        np.testing.assert_array_equal(getattr(state, name)[1], getattr(fresh, name)[1], err_msg=name)


def test_place_perturbs() -> None:
    parameters = table_2_1(num_vehicles=20)
    state = allocate(1, 3, 10)
    factors, offsets = np.full((1, 30), 1.1), np.full((1, 30), 20.0)
    steady, every = undisturbed(parameters, 30), np.ones(1, np.bool_)
    place(state, parameters, steady._replace(gap_factor=factors, speed_offset_mps=-offsets), every)
    gaps = -np.diff(state.position[0])
    assert state.position[0, 0] == 0.0
    np.testing.assert_allclose(gaps[:19], 1.1 * np.array([5.0] * 9 + [46.5] + [5.0] * 9))
    np.testing.assert_array_equal(state.speed[0], [11.0] * 20 + [0.0] * 10)
    place(state, parameters, steady._replace(speed_offset_mps=offsets), every)
    assert state.speed[0, :20].tolist() == [36.0] * 20
