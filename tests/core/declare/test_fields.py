from __future__ import annotations

from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.errors import UnknownNameError

numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
shapes = st.sampled_from([(), (1,), (3,), (2, 2)])


@st.composite
def layouts(draw: st.DrawFn) -> Fields:
    made = []
    for i in range(draw(st.integers(1, 4))):
        low = draw(numbers)
        width = draw(st.floats(1e-3, 1e6))
        made.append(Field(f"field_{i}", "m", low, low + width, draw(shapes)))
    return Fields(*made)


@given(layouts(), st.integers(1, 4), st.randoms())
def test_decode_gives_back_what_encode_was_given(layout: Fields, envs: int, random: Any) -> None:
    rng = np.random.default_rng(random.randrange(2**32))
    low = np.concatenate([np.full(field.size, field.low) for field in layout])
    high = np.concatenate([np.full(field.size, field.high) for field in layout])
    values = low + rng.random((envs, layout.size)) * (high - low)
    encoded = layout.encode(values)
    assert encoded.dtype == np.float32
    assert np.abs(encoded).max() <= 1
    assert all(layout.space().contains(row) for row in encoded)
    decoded = layout.decode(encoded)
    for field in layout:
        part = decoded[field.name]
        assert part.shape == (envs, *field.shape)
        expected = values[:, layout.slices[field.name]].reshape(part.shape)
        np.testing.assert_allclose(part, expected, rtol=0, atol=1e-6 * (field.high - field.low) + 1e-9 * abs(field.low))


@given(layouts())
def test_bounds_become_minus_one_and_one_and_the_rest_is_clipped(layout: Fields) -> None:
    low = np.concatenate([np.full(field.size, field.low) for field in layout])
    high = np.concatenate([np.full(field.size, field.high) for field in layout])
    encoded = layout.encode(np.stack([low, high, low - 1e3, high + 1e3, np.full_like(low, np.inf)]))
    np.testing.assert_allclose(encoded[:2], [[-1] * layout.size, [1] * layout.size], atol=1e-6)
    assert (encoded[2] == -1).all()
    assert (encoded[3:] == 1).all()


def test_nan_stays_visible() -> None:
    assert np.isnan(Fields(Field("x", "m", 0, 1)).encode(np.array([[np.nan]]))).all()


def test_encoding_is_fresh_and_leaves_the_values_alone() -> None:
    layout = Fields(Field("x", "m", 0, 2, (2,)))
    values = np.array([[0.0, 5.0]])
    one, two = layout.encode(values), layout.encode(values)
    assert not np.shares_memory(one, two)
    assert values.tolist() == [[0.0, 5.0]]


def test_decode_takes_any_leading_axes() -> None:
    layout = Fields(Field("x", "m", 0, 2), Field("y", "m", -1, 1, (2,)))
    assert layout.decode(np.zeros(3, np.float32))["y"].shape == (2,)
    assert layout.decode(np.zeros((5, 4, 3), np.float32))["x"].shape == (5, 4)
    with pytest.raises(ValueError, match="3 entries was expected"):
        layout.decode(np.zeros((1, 4)))


@pytest.mark.parametrize(("low", "high"), [(1, 1), (2, 1), (0, np.inf), (-np.inf, 0), (np.nan, 1)])
def test_bounds_have_to_be_finite_and_in_order(low: float, high: float) -> None:
    with pytest.raises(ValueError, match="has to be below"):
        Field("x", "m", low, high)


def test_names_have_to_differ() -> None:
    with pytest.raises(ValueError, match="name of its own"):
        Fields(Field("x", "m", 0, 1), Field("x", "m", 0, 2))
    with pytest.raises(ValueError, match="needs fields"):
        Fields()


def test_table_and_sequence() -> None:
    x, y = Field("x", "m", 0, 2, (), "where"), Field("y", "m/s", -1, 1, (2,))
    layout = Fields(x, y)
    assert (len(layout), layout.size, layout[1], list(layout)) == (2, 3, y, [x, y])
    assert layout.table().splitlines()[2:] == [
        "| 0 | `x` | 0 | 2 | m | where |",
        "| 1-2 | `y` | -1 | 1 | m/s |  |",
    ]


def test_a_field_without_entries_is_known_but_not_in_the_table() -> None:
    layout = Fields(Field("x", "m", 0, 2), Field("radio", "s", 0, 1, (0,)), Field("y", "m", -1, 1))
    assert layout.size == 2
    assert layout.decode(np.zeros((3, 2), np.float32))["radio"].shape == (3, 0)
    assert layout.table().splitlines()[2:] == ["| 0 | `x` | 0 | 2 | m |  |", "| 1 | `y` | -1 | 1 | m |  |"]


def test_a_field_is_a_value_that_nobody_changes() -> None:
    field = Field("x", "m", 0, 2)
    assert {field: 1}[Field("x", "m", 0, 2)] == 1
    with pytest.raises(FrozenInstanceError):
        field.high = 3  # type: ignore[misc]


def test_one_field_keeps_its_shape_and_an_unknown_one_is_named() -> None:
    layout = Fields(Field("speed", "m/s", 0.0, 10.0), Field("gaps", "m", 0.0, 100.0, (2, 2)))
    gaps = layout.decode_field("gaps", np.zeros((3, layout.size), np.float32))
    np.testing.assert_array_equal(gaps, np.full((3, 2, 2), 50.0))
    with pytest.raises(UnknownNameError, match="Did you mean 'gaps'"):
        layout.decode_field("gap", np.zeros((3, layout.size), np.float32))
