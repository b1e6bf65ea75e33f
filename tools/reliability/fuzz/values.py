"""Values that nobody should hand over, and some that look like them but are all right."""

from __future__ import annotations

import datetime
import decimal
import fractions
import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np

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
