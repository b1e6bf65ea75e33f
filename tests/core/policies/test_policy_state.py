from __future__ import annotations

import numpy as np

from cps_envs.core.policies.state import put, take

ROWS = np.array([0, 2])


def test_no_state_stays_none() -> None:
    assert take(None, ROWS) is None
    assert put(None, ROWS, None, 3) is None


def test_parts_are_put_and_taken() -> None:
    state = (np.arange(3), np.arange(6.0).reshape(3, 2))
    part = take(state, ROWS)
    assert part is not None
    assert part[0].tolist() == [0, 2]
    state = put(state, ROWS, (np.array([7, 8]), np.full((2, 2), -1.0)), 3)
    assert state is not None
    assert state[0].tolist() == [7, 1, 8]
    assert state[1].tolist() == [[-1, -1], [2, 3], [-1, -1]]


def test_environments_not_seen_before_are_zero() -> None:
    state = put(None, ROWS, (np.array([5, 6]), np.array([object(), "x"], object)), 3)
    assert state is not None
    assert state[0].tolist() == [5, 0, 6]
    assert state[1].dtype == object


def test_a_part_without_state_leaves_the_whole_as_it_is() -> None:
    state = (np.arange(3),)
    assert put(state, ROWS, None, 3) is state
