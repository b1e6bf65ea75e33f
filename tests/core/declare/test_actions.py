from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from cps_envs.core.declare.actions import ActionReader

BOX = spaces.Box(np.array([-1.0, 0.0], np.float32), np.array([1.0, 2.0], np.float32))
DISCRETE = spaces.Discrete(4, start=2)
MULTI = spaces.MultiDiscrete([3, 5])


@given(hnp.arrays(np.float64, (3, 2), elements=st.floats(-1e300, 1e300)))
def test_box_is_clipped_and_float64(actions: Any) -> None:
    read = ActionReader(BOX).batch(actions, 3)
    assert read.dtype == np.float64
    np.testing.assert_array_equal(read, np.clip(actions, BOX.low, BOX.high))


def test_a_busy_machine_fails_no_test_of_random_values() -> None:
    assert HealthCheck.too_slow in settings().suppress_health_check


@given(st.sampled_from([BOX, DISCRETE, MULTI]), st.data())
def test_whatever_is_handed_over_is_read_or_refused(space: spaces.Space[Any], data: st.DataObject) -> None:
    kinds = st.sampled_from([np.float16, np.float32, np.float64, np.int8, np.int64, np.uint64, np.bool_, "U3", object])
    shapes = st.sampled_from([(), (2,), (1, 2), (2, 1), (0,)])
    handed = data.draw(hnp.arrays(data.draw(kinds), data.draw(shapes), elements=None))
    try:
        read = ActionReader(space).single(handed)
    except ValueError:
        return
    assert read.shape == (1, *space.shape)
    assert space.contains(read[0].astype(space.dtype))


@pytest.mark.parametrize(
    ("space", "action"),
    [
        (DISCRETE, 2),
        (DISCRETE, np.int32(5)),
        (DISCRETE, 3.0),
        (MULTI, [2, 4]),
        (MULTI, np.array([0.0, 1.0], np.float32)),
        (BOX, [0, 1]),
    ],
)
def test_equal_numbers_of_any_type_are_taken(space: spaces.Space[Any], action: Any) -> None:
    np.testing.assert_array_equal(ActionReader(space).single(action)[0], action)


@pytest.mark.parametrize("action", [1, 6, 2.5, np.nan, np.inf, -1e30, 2**63, "2", None, True, [2], [[2]]])
def test_wrong_indices_are_refused(action: Any) -> None:
    with pytest.raises(ValueError, match=r"expected|whole number"):
        ActionReader(DISCRETE).single(action)


@pytest.mark.parametrize("action", [[np.nan, 0], [np.inf, 0], [0], 0, ["0", "1"], [None, 1]])
def test_wrong_forces_are_refused(action: Any) -> None:
    with pytest.raises(ValueError, match=r"expected|not finite"):
        ActionReader(BOX).single(action)


def test_messages_speak_of_one_action_or_of_a_batch() -> None:
    with pytest.raises(ValueError, match=r"an action of shape \(2,\) was expected.*got shape \(3,\)"):
        ActionReader(BOX).single(np.zeros(3))
    with pytest.raises(ValueError, match=r"actions of shape \(4, 2\) were expected.*got shape \(2,\)"):
        ActionReader(BOX).batch(np.zeros(2), 4)


def test_the_callers_array_stays_as_it_is() -> None:
    handed = np.full((1, 2), 9.0)
    read = ActionReader(BOX).batch(handed, 1)
    read[:] = 0
    assert (handed == 9.0).all()
    locked = np.zeros((1, 2))
    locked.flags.writeable = False
    ActionReader(BOX).batch(locked, 1)


@pytest.mark.parametrize("ragged", [[[1, 2], [3]], [1, [2]]], ids=str)
def test_rows_of_different_lengths_are_refused_in_a_sentence(ragged: Any) -> None:
    reader = ActionReader(spaces.MultiDiscrete([3, 3]))
    for read in (reader.single, lambda actions: reader.batch(actions, 2)):
        with pytest.raises(ValueError, match="rows of one length were expected for MultiDiscrete"):
            read(ragged)


@pytest.mark.parametrize("last", [1, 9], ids=["inside", "outside"])
def test_whole_numbers_for_a_box_become_real_ones(last: int) -> None:
    read = ActionReader(BOX).batch(np.array([[1, 2], [0, last]], np.int64), 2)
    assert read.dtype == np.float64
    assert read.tolist() == [[1.0, 2.0], [0.0, min(last, 2.0)]]
