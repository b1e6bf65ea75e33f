"""Generators of a batch are NumPy's, whether they are objects or not."""

from __future__ import annotations

import copy
import pickle

import gymnasium
import numpy as np
import pytest

from cps_envs.core.compute.generators import children, drawing, part_of, seeded, streams_of
from cps_envs.core.compute.kernels import kernel
from cps_envs.core.compute.streams import normal
from cps_envs.core.types import Array

ENTROPY = [0, 1, 7, 2**31, 2**32 - 1, 2**32, 2**64 + 5, 2**95, 2**128 - 1, 2**130 + 3, 2**200 + 11]
EVERY = np.arange(len(ENTROPY))


def state(generator: np.random.Generator) -> object:
    return generator.bit_generator.state


def test_thousands_of_seeds_give_numpys_streams() -> None:
    for seeds in (range(5000), range(2**32 - 2000, 2**32 + 2000), [2**64 - 1 + i for i in range(500)], ENTROPY):
        expected = [np.random.default_rng(seed) for seed in seeds]
        assert (streams_of(seeded(list(seeds))) == streams_of(expected)).all()


def test_the_objects_are_those_of_gymnasium() -> None:
    for ours, seed in zip(seeded(ENTROPY), ENTROPY, strict=True):
        theirs = gymnasium.utils.seeding.np_random(seed)[0]
        assert state(ours) == state(theirs)
        assert ours.bit_generator.seed_seq.entropy == seed  # type: ignore[attr-defined]
        assert [state(child) for child in ours.spawn(2)] == [state(child) for child in theirs.spawn(2)]


@kernel
def _draw(streams: Array, drawn: Array) -> None:
    for b in range(drawn.size):
        drawn[b] = normal(streams[b])


def test_kernels_and_objects_draw_in_turns() -> None:
    ours, theirs = seeded(ENTROPY), [np.random.default_rng(seed) for seed in ENTROPY]
    plain, drawn = [np.random.default_rng(seed) for seed in ENTROPY], np.empty(len(ENTROPY))
    for made in (0, 3, 3, len(ENTROPY)):
        for generators in (ours, plain):
            with drawing(generators, EVERY) as streams:
                _draw(streams, drawn)
            kept = drawn.tolist()
        assert kept == [generator.standard_normal() for generator in theirs]
        for b in range(made):
            number = theirs[b].integers(10, dtype=np.int32)  # leaves half a word over
            assert ours[b].integers(10, dtype=np.int32) == plain[b].integers(10, dtype=np.int32) == number
    for again in (pickle.loads(pickle.dumps(ours)), copy.deepcopy(ours)):
        assert [state(generator) for generator in again] == [state(generator) for generator in theirs]


@pytest.mark.parametrize("made", [0, 2, len(ENTROPY)])
def test_children_are_numpys(made: int) -> None:
    ours, theirs = seeded(ENTROPY), [np.random.default_rng(seed) for seed in ENTROPY]
    for rows in (EVERY, np.array([1, 4]), EVERY):
        families = [theirs[b].spawn(2) for b in rows]
        for child, generators in enumerate(children(ours, rows, 2)):
            assert [state(one) for one in generators] == [state(family[child]) for family in families]
            grandchildren = [family[child].spawn(1)[0] for family in families]
            assert [state(one) for one in children(generators, np.arange(len(rows)), 1)[0]] == list(
                map(state, grandchildren)
            )
        for b in range(made):
            ours[b].random()
            theirs[b].random()


def test_children_of_children_that_nobody_has_looked_at_are_numpys() -> None:
    found = children(children(seeded(ENTROPY), EVERY, 2)[1], EVERY, 3)
    for seed, b in zip(ENTROPY, EVERY, strict=True):
        grandchildren = np.random.default_rng(seed).spawn(2)[1].spawn(3)
        assert [state(generators[b]) for generators in found] == [state(one) for one in grandchildren]


def test_children_go_on_where_an_object_has_had_some() -> None:
    ours, theirs = seeded(ENTROPY), [np.random.default_rng(seed) for seed in ENTROPY]
    for generators in (ours, theirs):
        generators[2].spawn(3)
    for b, child in zip(EVERY, children(ours, EVERY, 1)[0], strict=True):
        assert state(child) == state(theirs[b].spawn(1)[0])


def test_a_part_goes_on_where_the_whole_is() -> None:
    ours, theirs = seeded(ENTROPY), [np.random.default_rng(seed) for seed in ENTROPY]
    ours[3].random(5)
    ours[3].spawn(1)
    theirs[3].random(5)
    theirs[3].spawn(1)
    for generators in (ours, theirs):
        part = part_of(generators, np.array([2, 3]))
        assert [state(one) for one in part] == [state(theirs[2]), state(theirs[3])]
    part = part_of(ours, np.array([3, 2]))
    assert state(children(part, np.array([0]), 1)[0][0]) == state(theirs[3].spawn(1)[0])


def test_slices_and_ends() -> None:
    ours = seeded(ENTROPY)
    assert [state(one) for one in ours[2:4]] == [state(np.random.default_rng(seed)) for seed in ENTROPY[2:4]]
    assert ours[-1] is ours[len(ENTROPY) - 1]
    with pytest.raises(IndexError):
        ours[len(ENTROPY)]
    assert len(list(ours)) == len(ENTROPY)


def test_seeds_that_are_missing_are_drawn_and_wrong_ones_refused() -> None:
    first, second = seeded([None, 5, None]), seeded([None, 5, None])
    assert state(first[0]) != state(second[0])
    assert state(first[1]) == state(second[1]) == state(np.random.default_rng(5))
    for wrong in (-1, 1.5):
        with pytest.raises(gymnasium.error.Error, match="Seed must be"):
            seeded([3, wrong])  # type: ignore[list-item]


def test_another_generator_gives_a_stream_too() -> None:
    generators = [np.random.Generator(np.random.MT19937(3)), np.random.default_rng(3)]
    assert streams_of(generators).all()
    with drawing(generators, np.arange(2)) as streams:
        assert streams.shape == (2, 6)
