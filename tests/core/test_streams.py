"""Seeds and streams are NumPy's own."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from cps_envs.core.kernels import borrowed, kernel
from cps_envs.core.streams import Seeds, Spawned, jumps, reserve, skip, spawning, streams, uniform
from cps_envs.core.types import Array, FloatArray

ENTROPY = [0, 1, 7, 2**31, 2**32 - 1, 2**32, 2**64 + 5, 2**95, 2**128 - 1, 2**130 + 3, 2**200 + 11]


@pytest.mark.parametrize("entropy", ENTROPY)
def test_seeds_are_seed_sequences(entropy: int) -> None:
    ours, theirs = Seeds(entropy), np.random.SeedSequence(entropy)
    for _ in range(3):
        for mine, other in zip([ours, *ours.spawn(2)], [theirs, *theirs.spawn(2)], strict=True):
            for size, kind in ((4, np.uint64), (3, np.uint64), (5, np.uint32)):
                assert mine.generate_state(size, kind).tolist() == other.generate_state(size, kind).tolist()
            assert mine.spawn_key == other.spawn_key
    for mine, other in zip(ours.spawn(1)[0].spawn(2), theirs.spawn(1)[0].spawn(2), strict=True):
        assert mine.generate_state(4).tolist() == other.generate_state(4).tolist()
    assert ours.n_children_spawned == theirs.n_children_spawned


@pytest.mark.parametrize("place", [0, 2**32 - 2, 2**32 - 1, 2**32, 2**40])
def test_a_child_of_any_place_is_that_of_a_seed_sequence(place: int) -> None:
    theirs = np.random.SeedSequence(7, spawn_key=(place,)).generate_state(4, np.uint64)
    assert Seeds(7, (place,)).generate_state(4, np.uint64).tolist() == theirs.tolist()


@pytest.mark.parametrize("bits", [np.random.PCG64, np.random.PCG64DXSM, np.random.Philox])
def test_a_quickly_spawning_generator_is_the_same(bits: type[np.random.BitGenerator]) -> None:
    ours, theirs = (np.random.Generator(bits(np.random.SeedSequence(9))) for _ in range(2))
    ours = spawning(ours)
    for a, b in zip([ours, *ours.spawn(3)], [theirs, *theirs.spawn(3)], strict=True):
        assert a.random(5).tolist() == b.random(5).tolist()
    again = pickle.loads(pickle.dumps(ours))
    assert again.spawn(1)[0].random() == theirs.spawn(1)[0].random()
    assert spawning(ours) is ours


@kernel
def _draw(stream: Array, jump: Array, drawn: FloatArray) -> None:
    place = np.empty(4, np.uint64)
    skip(stream, jump, place)
    for i in range(drawn.size):
        drawn[i] = uniform(borrowed(place))


@pytest.mark.parametrize("seed", range(5))
def test_kernels_draw_what_a_generator_draws(seed: int) -> None:
    generator = np.random.default_rng(seed)
    generator.random(seed)
    stream, table = streams([generator]), jumps(6, 50)
    expected = generator.random((50, 6))
    for time in range(50):
        drawn = np.empty(6)
        _draw(stream[0], table[time], drawn)
        assert drawn.tolist() == expected[time].tolist()


def test_children_that_are_not_made_have_streams_too() -> None:
    parents = [spawning(np.random.default_rng(seed)) for seed in ENTROPY] + [np.random.default_rng(4)]
    twins = [np.random.default_rng(seed) for seed in [*ENTROPY, 4]]
    for _ in range(3):
        own = Spawned(parents, [reserve(parent, 2)[1] for parent in parents])
        theirs = [twin.spawn(2)[1] for twin in twins]
        assert streams(own).tolist() == streams(theirs).tolist()
        assert [one.random() for one in own] == [one.random() for one in theirs]
        assert streams(own).tolist() == streams(theirs).tolist()


def test_another_generator_gives_a_stream_too() -> None:
    stream = streams([np.random.Generator(np.random.MT19937(3)), np.random.default_rng(3)])
    assert stream.shape == (2, 4)
    assert stream.all()
