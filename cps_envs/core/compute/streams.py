"""NumPy's random numbers inside kernels: what a `Generator` on a `PCG64` draws, bit for bit, without Python.

A stream is an array of words: state and increment, high words first, and then the half of a word that whole numbers
below 2^32 leave over: whether there is one, and its value. Algorithms: O'Neill's PCG XSL RR 128/64, Lemire's bounded
numbers, Marsaglia and Tsang's ziggurat with the tables that NumPy uses. NumPy keeps its numbers as they are for good;
tests compare them.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba.np.random import _constants as ziggurat

from cps_envs.core.compute.kernels import inlined
from cps_envs.core.types import Array, FloatArray, IntArray

WORDS = 6  # of a stream from which anything is drawn; uniform and normal numbers need the first four
ALL = 2**128 - 1
MULTIPLIER = 2549297995355413924 << 64 | 4865540595714422341  # of PCG64
HIGH, LOW = np.uint64(MULTIPLIER >> 64), np.uint64(MULTIPLIER & (2**64 - 1))
WORD, HALF = np.uint64(2**32 - 1), np.uint64(32)
INSIDE, WIDTHS, HEIGHTS = ziggurat.ki_double, ziggurat.wi_double, ziggurat.fi_double  # (256,) of its layers
TAIL, TAIL_RATE = ziggurat.ziggurat_nor_r, ziggurat.ziggurat_nor_inv_r  # where its tail begins, and the inverse


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
def next_word(high: Any, low: Any, up: Any, down: Any) -> tuple[Any, Any, Any]:
    """The next state and word of 64 bits after a state, given the increment (up, down)."""
    high, low = times(high, low, HIGH, LOW)
    high, low = plus(high, low, up, down)
    turn, value = high >> np.uint64(58), high ^ low
    return high, low, value >> turn | value << (np.uint64(64) - turn & np.uint64(63))


@inlined
def share_of(word: Any) -> Any:
    """A word as a number in [0, 1)."""
    return (word >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@inlined
def next_normal(high: Any, low: Any, up: Any, down: Any) -> tuple[Any, Any, Any]:
    """The next state after a state, and a standard normal number."""
    while True:
        high, low, word = next_word(high, low, up, down)
        layer, place = word & np.uint64(0xFF), word >> np.uint64(9) & np.uint64(0xFFFFFFFFFFFFF)
        value = place * WIDTHS[layer]
        if word >> np.uint64(8) & np.uint64(1):
            value = -value
        if place < INSIDE[layer]:
            return high, low, value
        if layer == 0:
            return next_in_tail(high, low, up, down, place >> np.uint64(8) & np.uint64(1))
        high, low, word = next_word(high, low, up, down)
        step = HEIGHTS[layer - np.uint64(1)] - HEIGHTS[layer]
        if step * share_of(word) + HEIGHTS[layer] < math.exp(-0.5 * value * value):
            return high, low, value


@inlined
def next_in_tail(high: Any, low: Any, up: Any, down: Any, negative: Any) -> tuple[Any, Any, Any]:
    """The same of a number beyond the ziggurat."""
    while True:
        high, low, word = next_word(high, low, up, down)
        beyond = -TAIL_RATE * math.log1p(-share_of(word))
        high, low, word = next_word(high, low, up, down)
        height = -math.log1p(-share_of(word))
        if height + height > beyond * beyond:
            return high, low, -(TAIL + beyond) if negative else TAIL + beyond


@inlined
def draw_word(stream: Array) -> Any:
    """The next word of 64 bits of a stream (k,), which goes on."""
    stream[0], stream[1], word = next_word(stream[0], stream[1], stream[2], stream[3])
    return word


@inlined
def uniform(stream: Array) -> float:
    """`Generator.random` of a stream (k,), which goes on."""
    number: float = share_of(draw_word(stream))
    return number


@inlined
def between(stream: Array, low: float, high: float) -> float:
    """`Generator.uniform(low, high)` of a stream (k,), which goes on."""
    return low + (high - low) * uniform(stream)


@inlined
def normal(stream: Array) -> float:
    """`Generator.standard_normal` of a stream (k,), which goes on."""
    stream[0], stream[1], number = next_normal(stream[0], stream[1], stream[2], stream[3])
    value: float = number
    return value


@inlined
def fill_uniform(stream: Array, numbers: FloatArray) -> None:
    """Fill numbers (n,) as `Generator.random(out=numbers)`."""
    high, low = stream[0], stream[1]
    for i in range(numbers.size):
        high, low, word = next_word(high, low, stream[2], stream[3])
        numbers[i] = share_of(word)
    stream[0], stream[1] = high, low


@inlined
def fill_normal(stream: Array, numbers: FloatArray) -> None:
    """Fill numbers (n,) as `Generator.standard_normal(out=numbers)`."""
    high, low, up, down = stream[0], stream[1], stream[2], stream[3]
    for i in range(numbers.size):
        high, low, numbers[i] = next_normal(high, low, up, down)
    stream[0], stream[1] = high, low


@inlined
def draw_half(stream: Array) -> Any:
    """The next word of 32 bits of a stream (6,): the half that is left over, or of a new word the lower half."""
    if stream[4] != 0:
        stream[4] = 0
        return stream[5]
    word = draw_word(stream)
    stream[4], stream[5] = 1, word >> HALF
    return word & WORD


@inlined
def whole(stream: Array, low: int, end: int) -> Any:
    """`Generator.integers(low, end)` of a stream (6,), which goes on; fewer than 2^32 numbers to choose from."""
    count = np.uint64(end - low)
    if count <= np.uint64(1):
        return low
    product = draw_half(stream) * count
    if product & WORD < count:
        rejected = (WORD - (count - np.uint64(1))) % count
        while product & WORD < rejected:
            product = draw_half(stream) * count
    return low + np.int64(product >> HALF)


@inlined
def shuffle(stream: Array, places: IntArray) -> None:
    """`Generator.permutation(n)` in places (n,), of a stream (6,), which goes on."""
    for i in range(places.size):
        places[i] = i
    for i in range(places.size - 1, 0, -1):
        mask, j = np.int64(1), np.int64(i + 1)
        while mask < i:
            mask = 2 * mask + 1
        while j > i:
            j = np.int64(draw_half(stream) & np.uint64(mask))
        places[i], places[j] = places[j], places[i]


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
