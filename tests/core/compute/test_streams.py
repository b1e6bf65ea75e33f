"""What kernels draw from streams is what NumPy's generators draw."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.compute.generators import drawing, seeded, streams_of
from cps_envs.core.compute.kernels import borrowed, kernel
from cps_envs.core.compute.streams import (
    between,
    draw_word,
    fill_normal,
    fill_uniform,
    jumps,
    normal,
    shuffle,
    skip,
    uniform,
    whole,
)
from cps_envs.core.types import Array, FloatArray, IntArray

ENDS = (1, 2, 3, 7, 1000, 2**31 + 5, 2**32 - 1, 2**32)


@kernel
def _skip_and_draw(stream: Array, jump: Array, drawn: FloatArray) -> None:
    place = np.empty(4, np.uint64)
    skip(stream, jump, place)
    for i in range(drawn.size):
        drawn[i] = uniform(borrowed(place))


@pytest.mark.parametrize("seed", range(5))
def test_streams_can_be_skipped(seed: int) -> None:
    generator = np.random.default_rng(seed)
    generator.random(seed)
    stream, table = streams_of([generator]), jumps(6, 50)
    expected = generator.random((50, 6))
    for time in range(50):
        drawn = np.empty(6)
        _skip_and_draw(stream[0], table[time], drawn)
        assert drawn.tolist() == expected[time].tolist()


@kernel
def _draw_all(stream: Array, numbers: FloatArray, wholes: IntArray, ends: IntArray, words: Array) -> None:
    """A little of everything, in the order of `expected`."""
    for i in range(wholes.size):
        wholes[i] = whole(stream, -3, ends[i] - 3)
    numbers[0], numbers[1], numbers[2] = uniform(stream), between(stream, -1.5, 4.0), normal(stream)
    words[0] = draw_word(stream)
    wholes[0] = whole(stream, 5, 9)
    fill_uniform(stream, numbers[3:8])
    fill_normal(stream, numbers[8:])


@pytest.mark.parametrize("seed", range(200))
def test_everything_is_drawn_as_a_generator_draws_it(seed: int) -> None:
    ours, theirs = np.random.default_rng(seed), np.random.default_rng(seed)
    numbers, words, ends = np.empty(100), np.empty(1, np.uint64), np.array(ENDS)
    for _ in range(5):  # from the second time on half a word may be left over
        wholes = np.empty(len(ENDS), np.int64)
        with drawing([ours], np.zeros(1, np.int64)) as streams:
            _draw_all(streams[0], numbers, wholes, ends, words)
        expected = [theirs.integers(-3, end - 3) for end in ENDS]
        assert wholes[1:].tolist() == expected[1:]
        assert numbers[:3].tolist() == [theirs.random(), theirs.uniform(-1.5, 4.0), theirs.standard_normal()]
        assert words[0] == theirs.integers(0, 2**64, dtype=np.uint64)
        assert wholes[0] == theirs.integers(5, 9)
        assert numbers[3:8].tolist() == theirs.random(5).tolist()
        assert numbers[8:].tolist() == theirs.standard_normal(92).tolist()
    assert ours.bit_generator.state == theirs.bit_generator.state


@kernel
def _fill(streams: Array, numbers: FloatArray) -> None:
    fill_normal(streams[0], numbers)


def test_a_million_normal_numbers_are_numpys() -> None:
    numbers = np.empty(1_000_000)  # 0.3 in a thousand lie in the tail
    _fill(seeded([8]).streams, numbers)
    assert (numbers == np.random.default_rng(8).standard_normal(numbers.size)).all()


@kernel
def _shuffle(streams: Array, places: IntArray) -> None:
    shuffle(streams[0], places)


@pytest.mark.parametrize("size", [0, 1, 2, 3, 8, 100])
def test_permutations_are_numpys(size: int) -> None:
    for seed in range(20):
        places = np.empty(size, np.int64)
        _shuffle(seeded([seed]).streams, places)
        assert places.tolist() == np.random.default_rng(seed).permutation(size).tolist()
