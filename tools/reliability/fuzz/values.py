"""Values that nobody should hand over, and some that look like them but are all right."""

from __future__ import annotations

import datetime
import decimal
import fractions
import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np
from gymnasium import spaces

from cps_envs.core.types import Array

Generator: TypeAlias = np.random.Generator
Choice = TypeVar("Choice")
Named: TypeAlias = tuple[str, Any]  # what it is, in words, and the value


def pick(choices: Sequence[Choice], rng: Generator) -> Choice:
    """One of them, all alike."""
    return choices[int(rng.integers(len(choices)))]


def in_words(value: Any) -> str:
    """A short description of anything."""
    try:
        return ascii(value)[:60]
    except RecursionError:
        return "something deep"


def shown(values: dict[str, Any]) -> str:
    """Values in a line, whatever they are."""
    return ", ".join(f"{name}={in_words(value)}" for name, value in values.items())


def nested(depth: int = 2000) -> list[Any]:
    """A list in a list in a list ..."""
    value: list[Any] = []
    for _ in range(depth):
        value = [value]
    return value


NUMBERS: Sequence[float] = (
    0,
    -0.0,
    1,
    -1,
    0.5,
    1.7,
    2,
    3,
    -7,
    10,
    1000,
    2**31,
    2**63,
    -(2**63) - 1,
    10**30,
    5e-324,
    1e-300,
    1e300,
    1.7976931348623157e308,
    math.nan,
    math.inf,
    -math.inf,
)
TEXTS = ("", " ", "none", "nan", "1", "paper", "[", "\x00", "\ud800", "a" * 5000, "../..", "%s", "{}", "None", "ü")
OTHERS: Sequence[Callable[[], Any]] = (
    lambda: None,
    lambda: True,
    lambda: False,
    lambda: [],
    lambda: (),
    lambda: {},
    lambda: set(),
    lambda: b"bytes",
    lambda: [[1], [1, 2]],
    lambda: nested(),
    lambda: (0, 1),
    lambda: (1, 0),
    lambda: [0, math.nan],
    lambda: {"a": 1},
    lambda: object(),
    lambda: int,
    lambda: len,
    lambda: 1j,
    lambda: ...,
    lambda: range(3),
    lambda: iter([1]),
    lambda: decimal.Decimal("1.5"),
    lambda: fractions.Fraction(1, 3),
    lambda: datetime.date(2020, 1, 1),
    lambda: np.float32(0.5),
    lambda: np.int8(1),
    lambda: np.bool_(True),
    lambda: np.array(1.0),
    lambda: np.array([1, 2]),
    lambda: np.array([]),
    lambda: np.array([1, "a"], object),
    lambda: np.datetime64("2020-01-01"),
    lambda: np.zeros((3, 3)),
    lambda: np.zeros(2, [("a", float)]),
    lambda: np.ma.masked_array([1.0, 2.0], [True, False]),
    lambda: np.random.default_rng(0),
)


def odd_value(rng: Generator) -> Named:
    """Anything at all."""
    kind = rng.random()
    if kind < 0.4:
        number = pick(NUMBERS, rng)
        return repr(number), number
    if kind < 0.55:
        text = pick(TEXTS, rng)
        return ascii(text[:20]), text
    place = int(rng.integers(len(OTHERS)))
    value = OTHERS[place]()
    return f"{type(value).__name__} (odd value {place})", value


def number_within(low: float, high: float, rng: Generator, whole: bool) -> float:
    """A number of an interval, which may be infinite: an end, or one of any size between them."""
    ends = [end for end in (low, high) if math.isfinite(end)]
    if ends and rng.random() < 0.3:
        value = pick(ends, rng)
    else:
        size = 10.0 ** rng.uniform(-4, 4)
        start = low if math.isfinite(low) else high if math.isfinite(high) else 0.0
        value = min(max(start + size if start == low else start - size, low), high)
    return round(value) if whole else value


def legal_batch(space: spaces.Space[Any], size: int, rng: Generator) -> Array:
    """Actions (size, ...) inside a space, many of them at its ends."""
    if isinstance(space, spaces.Box):
        share = rng.random((size, *space.shape))
        share = np.where(rng.random(share.shape) < 0.3, np.round(share), share)
        return np.asarray(space.low + share * (space.high - space.low), np.float64)
    counts = np.asarray(space.n if isinstance(space, spaces.Discrete) else space.nvec)  # type: ignore[attr-defined]
    start = np.asarray(space.start)  # type: ignore[attr-defined]
    return np.asarray(start + (rng.random((size, *counts.shape)) * counts).astype(np.int64))


def spoilt_batch(actions: Array, rng: Generator) -> Named:
    """The same actions with one or more entries that no space has, or in another form or type."""
    kind = pick(SPOILERS, rng)
    return kind.__name__.strip("_"), kind(actions, rng)


def _entry(actions: Array, rng: Generator) -> Array:
    changed = actions.astype(np.float64)
    place = rng.integers(changed.size) if changed.size else 0
    changed.reshape(-1)[place : place + 1] = pick(NUMBERS, rng)
    return changed


def _many_entries(actions: Array, rng: Generator) -> Array:
    values = np.array([float(number) for number in NUMBERS])
    return np.where(rng.random(actions.shape) < 0.2, rng.choice(values, actions.shape), actions)


def _type(actions: Array, rng: Generator) -> Array:
    kinds = ("f2", "f4", "f8", "i1", "i8", "u1", "u8", "?", "c16", "U8", "O", "S4", ">f8", ">i4", "longdouble")
    return actions.astype(pick(kinds, rng))


def _shape(actions: Array, rng: Generator) -> Array:
    twice = np.repeat(actions[np.newaxis], 2, axis=0)
    short = actions[:-1] if actions.ndim else twice
    return pick((short, twice, actions[..., np.newaxis], actions[np.newaxis], actions.ravel(), actions.T), rng)


def _layout(actions: Array, rng: Generator) -> Any:
    frozen = actions.copy()
    frozen.flags.writeable = False
    twice = np.repeat(actions, 2, axis=0)[::2] if actions.ndim else actions
    return pick((np.asfortranarray(actions), frozen, twice, actions.tolist()), rng)


def _ragged(actions: Array, rng: Generator) -> Any:
    rows = actions.tolist()
    return [*rows[:-1], [rows[-1], rows[-1]]] if isinstance(rows, list) and rows else [rows, [rows]]


def _anything(actions: Array, rng: Generator) -> Any:
    return odd_value(rng)[1]


SPOILERS: Sequence[Callable[[Array, Generator], Any]] = (
    _entry,
    _many_entries,
    _type,
    _shape,
    _layout,
    _ragged,
    _anything,
    _anything,
)
