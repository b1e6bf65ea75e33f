"""The random generators of a batch: NumPy's own, seeded in a kernel and made as objects only when asked for.

The numbers are those of `numpy.random.default_rng(seed)`, which NumPy keeps as they are for good. Algorithm: O'Neill's
seed_seq.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, cast, overload

import numpy as np
from gymnasium.utils import seeding

from cps_envs.core.compute.kernels import borrowed, inlined, kernel, room
from cps_envs.core.compute.streams import HIGH, LOW, WORD, WORDS, plus, times
from cps_envs.core.types import Array, Generators, IntArray

POOL = 4  # words of 32 bits that a seed is mixed into
NO_KEY = -1  # of a generator that nobody has spawned
LOW_WORD = 2**64 - 1
SHIFT, HALF, ONE = np.uint64(16), np.uint64(32), np.uint64(1)
INIT_A, MULT_A = np.uint64(0x43B0D7E5), np.uint64(0x931E8875)
INIT_B, MULT_B = np.uint64(0x8B51F9DD), np.uint64(0x58F38DED)
MIX_LEFT, MIX_RIGHT = np.uint64(0xCA01F9DD), np.uint64(0x4973F715)


class Lazy(Sequence[np.random.Generator]):
    """Generators of seeds, or their children. Kernels draw from the `streams`, see `drawing`."""

    def __init__(self, entropy: Sequence[int], words: Array, sizes: IntArray, keys: IntArray) -> None:
        """The seeds, also as `words` (B, k) of 32 bits of which `sizes` (B,) count; `keys` (B,) of children."""
        self._entropy, self._words, self._sizes, self._keys = entropy, words, sizes, keys
        self._spawned = np.zeros(len(keys), np.int64)  # children so far
        self._made: dict[int, np.random.Generator] = {}
        self.streams: Array = np.empty((len(keys), WORDS), np.uint64)
        _start(words, sizes, keys, self.streams)

    def __len__(self) -> int:
        return len(self._keys)

    @overload
    def __getitem__(self, index: int) -> np.random.Generator: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[np.random.Generator]: ...
    def __getitem__(self, index: int | slice) -> np.random.Generator | Sequence[np.random.Generator]:
        if isinstance(index, slice):
            return [self[place] for place in range(len(self))[index]]
        place = range(len(self))[index]
        if place not in self._made:
            key = () if self._keys[place] == NO_KEY else (int(self._keys[place]),)
            children = int(self._spawned[place])
            seeds = np.random.SeedSequence(self._entropy[place], spawn_key=key, n_children_spawned=children)
            generator = np.random.Generator(np.random.PCG64(seeds))
            _put(self.streams[place], generator)
            self._made[place] = generator
        return self._made[place]

    @property
    def seeds(self) -> tuple[Array, IntArray]:
        """The seeds as words (B, k) of 32 bits, and how many of them count (B,), for kernels that spawn."""
        return self._words, self._sizes

    def seed(self, place: int) -> int:
        """The seed of a generator, also of its children."""
        return self._entropy[place]

    def made(self, rows: IntArray) -> Iterable[int]:
        """Those of some places whose generators are objects."""
        return [place for place in rows.tolist() if place in self._made] if self._made else ()

    def children(self, rows: IntArray, count: int) -> list[Generators]:
        """`Generator.spawn(count)` of the generators `rows` (k,): of each child the k generators."""
        if self.made(rows) or (self._keys[rows] != NO_KEY).any():
            return _spawn([self[place] for place in rows.tolist()], count)
        entropy = [self._entropy[place] for place in rows.tolist()]
        words, sizes, first = self._words[rows], self._sizes[rows], self._spawned[rows]
        self._spawned[rows] += count
        return [Lazy(entropy, words, sizes, first + child) for child in range(count)]

    def part(self, rows: IntArray) -> Lazy:
        """Copies of the generators `rows` (k,)."""
        for place in self.made(rows):
            _take(self._made[place], self.streams[place])
            self._spawned[place] = cast(Any, self._made[place].bit_generator.seed_seq).n_children_spawned
        part = Lazy([self._entropy[place] for place in rows.tolist()], *self._known(rows))
        part.streams[:], part._spawned[:] = self.streams[rows], self._spawned[rows]
        return part

    def state(self, rows: IntArray) -> tuple[Array, IntArray]:
        """Streams (k, 6) of the generators `rows` (k,) now, and how many children each has had (k,)."""
        part = self.part(rows)
        return part.streams, part._spawned

    def go_on(self, streams: Array, spawned: IntArray) -> None:
        """Go on from such a state of all of them, (B, 6) and (B,)."""
        self._made.clear()
        self.streams[:], self._spawned[:] = streams, spawned

    def _known(self, rows: IntArray) -> tuple[Array, IntArray, IntArray]:
        return self._words[rows], self._sizes[rows], self._keys[rows]


def seeded(seeds: Sequence[int | None]) -> Lazy:
    """`gymnasium.utils.seeding.np_random(seed)[0]` for each seed; None draws one.

    Raises:
        gymnasium.error.Error: a seed is negative, or no whole number.
    """
    for seed in seeds:
        if type(seed) is not int or seed < 0:
            seeds = [seeding.np_random(seed)[1] for seed in seeds]
            break
    entropy = cast("Sequence[int]", seeds)
    most = max(entropy, default=0)
    if most < 2**32:
        words = np.array(entropy, np.uint64).reshape(-1, 1)
        sizes = np.ones(len(entropy), np.int64)
    else:
        sizes = np.array([max(1, (seed.bit_length() + 31) // 32) for seed in entropy], np.int64)
        words = np.array([[seed >> 32 * i & 0xFFFFFFFF for i in range(sizes.max())] for seed in entropy], np.uint64)
    return Lazy(entropy, words, sizes, np.full(len(entropy), NO_KEY))


def seed_of(generators: Generators, b: int) -> int:
    """The seed of a generator, also of its children; -1 where it has none that is one number."""
    if isinstance(generators, Lazy):
        return generators.seed(b)
    seed = getattr(generators[b].bit_generator.seed_seq, "entropy", None)
    return int(seed) if isinstance(seed, (int, np.integer)) else -1


def part_of(generators: Generators, rows: IntArray) -> Generators:
    """The generators `rows` (k,)."""
    return generators.part(rows) if isinstance(generators, Lazy) else [generators[b] for b in rows.tolist()]


def children(generators: Generators, rows: IntArray, count: int) -> list[Generators]:
    """`Generator.spawn(count)` of the generators `rows` (k,): of each child the k generators."""
    if isinstance(generators, Lazy):
        return generators.children(rows, count)
    return _spawn([generators[b] for b in rows.tolist()], count)


def _spawn(parents: Generators, count: int) -> list[Generators]:
    families = [parent.spawn(count) for parent in parents]
    return [[family[child] for family in families] for child in range(count)]


@contextmanager
def drawing(generators: Generators, rows: IntArray) -> Iterator[Array]:
    """The streams (B, 6) of B generators, for kernels that draw from those of `rows` (k,); these go on afterwards.

    Where one is no `PCG64`, a new one is seeded from it.
    """
    streams, objects = _streams(generators, rows)
    yield streams
    for b in objects:
        _put(streams[b], generators[b])


def streams_of(generators: Generators) -> Array:
    """A copy of the streams (B, 4) of B generators for uniform and normal numbers; they themselves do not go on."""
    streams, _ = _streams(generators, np.arange(len(generators)))
    return streams[:, :4].copy()


def _streams(generators: Generators, rows: IntArray) -> tuple[Array, Iterable[int]]:
    """Streams (B, 6) that are right at `rows` (k,), and the places of generators that are objects."""
    if isinstance(generators, Lazy):
        streams, objects = generators.streams, generators.made(rows)
    else:
        streams, objects = np.empty((len(generators), WORDS), np.uint64), rows.tolist()
    for b in objects:
        _take(generators[b], streams[b])
    return streams, objects


def _take(generator: np.random.Generator, stream: Array) -> None:
    """Fill the stream (6,) of a generator."""
    bits = generator.bit_generator
    if not isinstance(bits, np.random.PCG64):
        bits = np.random.PCG64(int(generator.integers(2**62)))
    now: Any = bits.state
    state, step = now["state"]["state"], now["state"]["inc"]
    words = (state >> 64, state & LOW_WORD, step >> 64, step & LOW_WORD, now["has_uint32"], now["uinteger"])
    for i in range(WORDS):
        stream[i] = words[i]


def _put(stream: Array, generator: np.random.Generator) -> None:
    """Let a generator go on from a stream (6,)."""
    bits = generator.bit_generator
    if not isinstance(bits, np.random.PCG64):
        return
    high, low, up, down, left, half = stream.tolist()
    now: Any = {"state": high << 64 | low, "inc": up << 64 | down}
    bits.state = {"bit_generator": "PCG64", "state": now, "has_uint32": left, "uinteger": half}


@kernel
def _start(words: Array, sizes: IntArray, keys: IntArray, streams: Array) -> None:
    """Fill the streams (B, 6) of new `PCG64` from seeds, see `Lazy`."""
    for b in range(sizes.size):
        start(borrowed(words)[b, : sizes[b]], keys[b], borrowed(streams)[b])


@inlined
def start(entropy: Array, key: int, stream: Array) -> None:
    """Fill the stream (6,) of a new `PCG64` with a seed (k,) in words, and the key of a child, or -1."""
    seed = room(POOL, np.uint64)
    mix(entropy, key, seed)
    stream[2], stream[3] = seed[2] << ONE | seed[3] >> np.uint64(63), seed[3] << ONE | ONE
    high, low = plus(seed[0], seed[1], stream[2], stream[3])
    high, low = times(high, low, HIGH, LOW)
    stream[0], stream[1] = plus(high, low, stream[2], stream[3])
    stream[4] = stream[5] = 0


@inlined
def mix(entropy: Array, key: int, state: Array) -> None:
    """Fill the `generate_state(4, uint64)` of a seed (k,) in words, and the key of a child, or -1."""
    pool, constant, size = room(POOL, np.uint64), INIT_A, entropy.size
    for i in range(POOL):
        pool[i], constant = hashed(entropy[i] if i < size else np.uint64(0), constant)
    for source in range(POOL):
        for i in range(POOL):
            if source != i:
                value, constant = hashed(pool[source], constant)
                pool[i] = mixed(pool[i], value)
    for word in range(POOL, max(size, POOL) + 1):
        last = word >= size
        if last and key < 0:
            break
        for i in range(POOL):
            value, constant = hashed(np.uint64(key) if last else entropy[word], constant)
            pool[i] = mixed(pool[i], value)
    constant = INIT_B
    for word in range(2 * POOL):
        value = pool[word % POOL] ^ constant
        constant = constant * MULT_B & WORD
        value = value * constant & WORD
        value ^= value >> SHIFT
        if word % 2 == 0:
            state[word // 2] = value
        else:
            state[word // 2] |= value << HALF


@inlined
def hashed(value: Any, constant: Any) -> tuple[Any, Any]:
    """A word after hashing, and the next constant."""
    value = value ^ constant
    constant = constant * MULT_A & WORD
    value = value * constant & WORD
    return value ^ (value >> SHIFT), constant


@inlined
def mixed(a: Any, b: Any) -> Any:
    """Two words made one."""
    value = (MIX_LEFT * a - MIX_RIGHT * b) & WORD
    return value ^ (value >> SHIFT)
