"""NumPy's random numbers where Python would take too long: seeds that spawn quickly, and draws inside kernels.

The numbers are those of `numpy.random.SeedSequence` and of `Generator.random` on a `PCG64`, which NumPy keeps as they
are for good. Algorithms: O'Neill's seed_seq and PCG XSL RR 128/64.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, overload

import numpy as np
from numpy.random.bit_generator import ISpawnableSeedSequence, SeedSequence

from cps_envs.core.kernels import inlined, kernel
from cps_envs.core.types import Array

POOL = 4  # words of 32 bits that a seed is mixed into
ALL = 2**128 - 1
MULTIPLIER = 2549297995355413924 << 64 | 4865540595714422341  # of PCG64
HIGH, LOW = np.uint64(MULTIPLIER >> 64), np.uint64(MULTIPLIER & (2**64 - 1))
WORD, SHIFT, HALF, ONE = np.uint64(2**32 - 1), np.uint64(16), np.uint64(32), np.uint64(1)
INIT_A, MULT_A = np.uint64(0x43B0D7E5), np.uint64(0x931E8875)
INIT_B, MULT_B = np.uint64(0x8B51F9DD), np.uint64(0x58F38DED)
MIX_LEFT, MIX_RIGHT = np.uint64(0xCA01F9DD), np.uint64(0x4973F715)


class Seeds(ISpawnableSeedSequence):
    """`SeedSequence(entropy, spawn_key=spawn_key)`, whose children are made ten times as fast."""

    def __init__(self, entropy: int, spawn_key: tuple[int, ...] = (), words: Array | None = None) -> None:
        self.entropy, self.spawn_key, self.n_children_spawned = entropy, spawn_key, 0
        self.words = _words(entropy) if words is None else words  # of the entropy

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> Array:
        """See `SeedSequence.generate_state`."""
        if n_words != POOL or dtype is not np.uint64 or any(place > WORD for place in self.spawn_key):
            return SeedSequence(self.entropy, spawn_key=self.spawn_key).generate_state(n_words, dtype)
        state = np.empty(POOL, np.uint64)
        _seed(self.words, self.spawn_key[-1] if self.spawn_key else -1, state)
        return state

    def spawn(self, n_children: int) -> list[Any]:
        """See `SeedSequence.spawn`; grandchildren are NumPy's own."""
        return [self.child(place) for place in self.reserve(n_children)]

    def reserve(self, n_children: int) -> range:
        """The places of children that nobody else gets; each may then be made or not."""
        first = self.n_children_spawned
        self.n_children_spawned += n_children
        return range(first, self.n_children_spawned)

    def child(self, place: int) -> Any:
        """The child of a place."""
        key = (*self.spawn_key, place)
        return SeedSequence(self.entropy, spawn_key=key) if self.spawn_key else Seeds(self.entropy, key, self.words)


def spawning(generator: np.random.Generator) -> np.random.Generator:
    """The same generator as it was when it was made, with children that are made quickly; or itself if it has none."""
    seeds: Any = generator.bit_generator.seed_seq
    if type(seeds) is not SeedSequence or seeds.spawn_key or not isinstance(seeds.entropy, int):
        return generator
    kind: Any = type(generator.bit_generator)
    return np.random.Generator(kind(Seeds(seeds.entropy)))


def reserve(generator: np.random.Generator, count: int) -> Sequence[Any]:
    """So many children of a generator for `Spawned`: their seeds, or where that is quicker their places."""
    bits: Any = generator.bit_generator
    seeds = bits.seed_seq
    quick = type(seeds) is Seeds and type(bits) is np.random.PCG64 and not seeds.spawn_key
    kept: Sequence[Any] = seeds.reserve(count) if quick else seeds.spawn(count)
    return kept


class Spawned(Sequence[np.random.Generator]):
    """What `Generator.spawn` gives each of several parents; made when asked for, since many policies never do."""

    def __init__(self, parents: Sequence[np.random.Generator], children: Sequence[Any]) -> None:
        self._parents, self._children = parents, children  # see `reserve`
        self._made: dict[int, np.random.Generator] = {}

    def __len__(self) -> int:
        return len(self._children)

    @overload
    def __getitem__(self, index: int) -> np.random.Generator: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[np.random.Generator]: ...
    def __getitem__(self, index: int | slice) -> np.random.Generator | Sequence[np.random.Generator]:
        if isinstance(index, slice):
            return [self[place] for place in range(len(self))[index]]
        place = range(len(self))[index]
        if place not in self._made:
            parent, seeds = self._parents[place], self._children[place]
            bits: Any = parent.bit_generator
            if isinstance(seeds, int):
                seeds = bits.seed_seq.child(seeds)
            self._made[place] = type(parent)(type(bits)(seeds))
        return self._made[place]

    def start(self, place: int, stream: Array) -> bool:
        """Fill the stream (4,) of a generator that is not made yet; False where it has to be made."""
        child, bits = self._children[place], self._parents[place].bit_generator
        if place in self._made or not isinstance(child, int):
            return False
        seeds: Any = bits.seed_seq
        _start(seeds.words, child, stream)
        return True


def _words(entropy: int) -> Array:
    """A seed in words of 32 bits, the lowest first."""
    size = max(1, (entropy.bit_length() + 31) // 32)
    return np.array([entropy >> 32 * place & 0xFFFFFFFF for place in range(size)], np.uint64)


@kernel
def _seed(entropy: Array, key: int, state: Array) -> None:
    """See `mix`."""
    mix(entropy, key, state)


@inlined
def mix(entropy: Array, key: int, state: Array) -> None:
    """Fill the `generate_state(4, uint64)` of a seed (k,) in words, and the key of a child, or -1."""
    pool, constant, size = np.zeros(POOL, np.uint64), INIT_A, entropy.size
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


@kernel
def _start(entropy: Array, key: int, stream: Array) -> None:
    """Fill the stream (4,) of a new `PCG64` with a seed (k,) in words, and the key of a child, or -1."""
    seed = np.empty(POOL, np.uint64)
    mix(entropy, key, seed)
    stream[2], stream[3] = seed[2] << ONE | seed[3] >> np.uint64(63), seed[3] << ONE | ONE
    high, low = plus(seed[0], seed[1], stream[2], stream[3])
    high, low = times(high, low, HIGH, LOW)
    stream[0], stream[1] = plus(high, low, stream[2], stream[3])


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


def streams(generators: Sequence[np.random.Generator]) -> Array:
    """What kernels need to draw the next numbers of each generator: (B, 4) words of state and increment, high first.

    The generators themselves do not go on. Where one is no `PCG64`, a new one is seeded from it.
    """
    made = np.empty((len(generators), 4), np.uint64)
    for b in range(len(generators)):
        if isinstance(generators, Spawned) and generators.start(b, made[b]):
            continue
        generator = generators[b]
        bits = generator.bit_generator
        if not isinstance(bits, np.random.PCG64):
            bits = np.random.PCG64(int(generator.integers(2**62)))
        own: Any = bits.state["state"]
        state, step = own["state"], own["inc"]
        made[b] = state >> 64, state & (2**64 - 1), step >> 64, step & (2**64 - 1)
    return made


def jumps(draws: int, times: int) -> Array:
    """How to skip 0, 1, ... times so many draws: (times, 4) words of a factor of the state and one of the increment."""
    factor, added = 1, 0
    for _ in range(draws):
        factor, added = factor * MULTIPLIER & ALL, (added * MULTIPLIER + 1) & ALL
    table = np.empty((times, 4), np.uint64)
    whole, sums = 1, 0
    for time in range(times):
        table[time] = whole >> 64, whole & (2**64 - 1), sums >> 64, sums & (2**64 - 1)
        whole, sums = whole * factor & ALL, (sums * factor + added) & ALL
    return table


@inlined
def skip(stream: Array, jump: Array, place: Array) -> None:
    """Fill `place` (4,), a stream after one of the `jumps` (4,)."""
    high, low = times(stream[0], stream[1], jump[0], jump[1])
    more, less = times(stream[2], stream[3], jump[2], jump[3])
    place[0], place[1] = plus(high, low, more, less)
    place[2], place[3] = stream[2], stream[3]


@inlined
def uniform(place: Array) -> float:
    """The next number in [0, 1) of a stream (4,), which goes on."""
    high, low = times(place[0], place[1], HIGH, LOW)
    high, low = plus(high, low, place[2], place[3])
    place[0], place[1] = high, low
    turn, value = high >> np.uint64(58), high ^ low
    value = value >> turn | value << (np.uint64(64) - turn & np.uint64(63))
    number: float = (value >> np.uint64(11)) * (1.0 / 9007199254740992.0)
    return number


@inlined
def times(a_high: Any, a_low: Any, b_high: Any, b_low: Any) -> tuple[Any, Any]:
    """The product of two numbers of 128 bits, modulo 2^128."""
    a, b, c, d = a_low >> HALF, a_low & WORD, b_low >> HALF, b_low & WORD
    middle = a * d + (b * d >> HALF)
    carried = (middle & WORD) + b * c
    top = a * c + (middle >> HALF) + (carried >> HALF)
    return top + a_high * b_low + a_low * b_high, a_low * b_low


@inlined
def plus(a_high: Any, a_low: Any, b_high: Any, b_low: Any) -> tuple[Any, Any]:
    """The sum of two numbers of 128 bits, modulo 2^128."""
    low = a_low + b_low
    return a_high + b_high + np.uint64(low < a_low), low
