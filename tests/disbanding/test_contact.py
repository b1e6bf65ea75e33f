"""What touching does to a string of five vehicles: who counts as collided, who stays behind whom, and who stands."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.compute.kernels import unpack, view
from cps_envs.core.types import Array
from cps_envs.disbanding.dynamics import advance, has_ended, keep_order, mark_collisions, stand_still
from cps_envs.disbanding.state import Constants, State
from tests.disbanding.table_2_1 import start, table_2_1

FIVE = {"num_vehicles": 5, "vehicles_per_platoon": 5}


def string(position: list[float], speed: list[float] | None = None, **changes: object) -> tuple[Array, State]:
    """Constants (1,) and the state of five vehicles at these positions, front to rear."""
    parameters = table_2_1(**FIVE, **changes)
    state = start(parameters, num_platoons=1)
    state.position[0] = position
    if speed is not None:
        state.speed[0] = speed
    return parameters, state


def test_who_touches_the_vehicle_ahead_has_collided_and_so_has_that_one() -> None:
    parameters, state = string([40.0, 40.0, 30.0, 20.0, 20.1])
    state.step[0] = 9
    mark_collisions(view(state, 0), unpack(Constants, parameters, 0))
    assert state.rear_collided[0].tolist() == [False, True, False, False, True]
    assert state.collided[0].tolist() == [True, True, False, True, True]
    assert state.first_collision_s[0] == pytest.approx(0.1)


@pytest.mark.parametrize("rear", [0, 1, 2, 3])
def test_touching_without_a_gap_is_enough_wherever_it_happens(rear: int) -> None:
    position = [50.0, 40.0, 30.0, 20.0, 10.0]
    position[rear + 1] = position[rear]
    parameters, state = string(position)
    mark_collisions(view(state, 0), unpack(Constants, parameters, 0))
    assert state.rear_collided[0].nonzero()[0].tolist() == [rear + 1]


def test_who_touches_the_vehicle_ahead_stays_behind_it_and_is_not_faster() -> None:
    parameters, state = string([40.0, 40.0, 30.0, 31.0, 10.0], [3.0, 4.0, 2.0, 1.0, 9.0])
    state.acceleration[0] = [0.1, 0.2, 0.3, 0.4, 0.5]
    keep_order(view(state, 0), unpack(Constants, parameters, 0))
    assert state.position[0].tolist() == [40.0, 40.0, 30.0, 30.0, 10.0]
    assert state.speed[0].tolist() == [3.0, 3.0, 2.0, 1.0, 9.0]
    assert state.acceleration[0].tolist() == [0.1, 0.1, 0.3, 0.4, 0.5]


def test_touching_vehicles_keep_their_order_whatever_their_speeds() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        parameters, state = string(np.round(rng.uniform(0, 4, 5)).tolist(), rng.uniform(0, 30, 5).tolist())
        before = state.position[0].copy(), state.speed[0].copy()
        keep_order(view(state, 0), unpack(Constants, parameters, 0))
        position, speed = state.position[0], state.speed[0]
        assert (np.diff(position) <= 0).all()
        assert (position <= before[0]).all()
        assert (speed <= before[1]).all()
        touching = np.diff(position) == 0
        assert (np.diff(speed)[touching] <= 0).all()


def test_who_is_nearer_than_the_standstill_gap_stands() -> None:
    parameters, state = string([40.0, 39.5, 38.5, 37.6, 30.0], [5.0] * 5, standstill_gap_m=1.0)
    state.acceleration[0] = 0.5
    stand_still(view(state, 0), unpack(Constants, parameters, 0))
    assert state.speed[0].tolist() == [5.0, 0.0, 5.0, 0.0, 5.0]
    assert state.acceleration[0].tolist() == [0.5, 0.0, 0.5, 0.0, 0.5]


@pytest.mark.parametrize(("stops", "expected"), [(True, 1), (False, 3)])
def test_an_episode_may_stand_still_from_a_collision_of_an_intact_vehicle_on(stops: bool, expected: int) -> None:
    parameters, state = string([50.0, 40.0, 30.0, 30.0, 10.0], [20.0] * 5, stop_at_collision=stops)
    episode, constants = view(state, 0), unpack(Constants, parameters, 0)
    assert not has_ended(episode, constants)
    for _ in range(3):
        advance(state, parameters, np.zeros((1, 5)), np.ones(1, np.bool_), 1)
    assert state.step[0] == expected
    assert state.collided_intact[0].tolist() == [False, False, True, True, False]
    assert has_ended(episode, constants) == stops
