"""A quantity over time as a value of a configuration: immutable, hashable, and known by its content."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any, final

import numpy as np

from cps_envs.core.errors import ConfigurationError, shown
from cps_envs.core.types import FloatArray

RULES = {  # of resampling: what a series is between two samples
    "linear": "on the straight line between them",
    "hold": "as the sample before",
}
EVEN = 1e-3  # share of the step by which times may be off
NEAR = 1e-6  # share of the step by which a time may lie before a sample that it means
ARGUMENTS = ("values", "step_s", "begin_s", "repeats")


@final
class Series:
    """Values (K,), or (K, n) for n bodies or columns, one row each `step_s` from `begin_s` on.

    `begin_s` counts from the origin of the game's time, which is midnight in a building. A series that `repeats` goes
    on with its first row after the last, for all times: 24 hourly set-points are every day's. Equality, hash and
    `repr` are of the content; `source` says where it comes from, for messages.

    Raises:
        ConfigurationError: values that are not finite numbers, fewer than two rows, or an impossible step.
    """

    __slots__ = ("_lines", "begin_s", "digest", "repeats", "source", "step_s", "values")

    values: FloatArray  # (K, n), read-only
    step_s: float
    begin_s: float
    repeats: bool
    digest: str  # of all above
    source: str
    _lines: Any  # of the file, by row, or None

    def __init__(
        self,
        values: Any,
        step_s: float,
        begin_s: float = 0.0,
        repeats: bool = False,
        *,
        source: str = "",
        lines: Any = None,
    ) -> None:
        table = _table(values)
        for name, number in (("step_s", step_s), ("begin_s", begin_s)):
            if isinstance(number, bool) or not isinstance(number, (int, float, np.number)) or not np.isfinite(number):
                raise ConfigurationError(f"{name} = {shown(number)} of a series must be a number in s.")
        if step_s <= 0:
            raise ConfigurationError(f"step_s = {step_s} of a series must be above 0 s.")
        if not isinstance(repeats, bool):
            raise ConfigurationError(f"repeats = {shown(repeats)} of a series must be True or False.")
        table.flags.writeable = False
        content = hashlib.sha256(repr((table.shape, float(step_s), float(begin_s), repeats)).encode())
        content.update(table.astype("<f8").tobytes())
        put = object.__setattr__
        for name, value in (
            *(("values", table), ("step_s", float(step_s)), ("begin_s", float(begin_s)), ("repeats", repeats)),
            *(("digest", content.hexdigest()[:16]), ("source", source), ("_lines", lines)),
        ):
            put(self, name, value)

    @property
    def width(self) -> int:
        """Number n of columns."""
        return int(self.values.shape[1])

    @property
    def end_s(self) -> float:
        """Time of the last row; a series that repeats has none, so infinity."""
        return float("inf") if self.repeats else self.begin_s + (len(self.values) - 1) * self.step_s

    def place(self, row: int) -> str:
        """Where a row stands, for messages."""
        if self._lines is None:
            return f"sample {row}{f' of {self.source}' if self.source else ''}"
        return f"line {int(self._lines[row])} of {self.source}"

    def at(self, times_s: FloatArray, rule: str) -> FloatArray:
        """The values (T, n) at some times (T,) by a rule of `RULES`; the first and the last row hold on outside."""
        rows = (np.asarray(times_s, np.float64) - self.begin_s) / self.step_s
        count, whole = len(self.values), np.floor(rows + NEAR)
        share = np.maximum(rows - whole, 0.0)[:, np.newaxis]
        index, following = whole.astype(np.int64), whole.astype(np.int64) + 1
        if self.repeats:
            index, following = index % count, following % count
        else:
            share = np.where((index < 0)[:, np.newaxis] | (index >= count - 1)[:, np.newaxis], 0.0, share)
            index, following = np.clip(index, 0, count - 1), np.clip(following, 0, count - 1)
        here = self.values[index]
        found: FloatArray = here if rule == "hold" else here + share * (self.values[following] - here)
        return found

    def to_json(self) -> dict[str, Any]:
        """What documents say of it: everything but the values, for which the digest stands."""
        return {
            "series": list(self.values.shape),
            "step_s": self.step_s,
            "begin_s": self.begin_s,
            "repeats": self.repeats,
            "sha256": self.digest,
        }

    def __repr__(self) -> str:
        begin = f", begin_s={self.begin_s:g}" if self.begin_s else ""
        shape = " x ".join(map(str, self.values.shape))
        return f"Series({shape}, step_s={self.step_s:g}{begin}{', repeats' * self.repeats}, sha256={self.digest})"

    def __eq__(self, other: object) -> bool:
        return self.digest == other.digest if isinstance(other, Series) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a series cannot be changed: make another one to set {name!r}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a series cannot be changed: {name!r} stays")

    def __copy__(self) -> Series:
        return self

    def __deepcopy__(self, memo: object) -> Series:
        return self

    def __reduce__(self) -> Any:
        return _again, (self.values, self.step_s, self.begin_s, self.repeats, self.source, self._lines)


def series_of(name: str, given: Mapping[str, Any]) -> Series:
    """A series that is written as an object, as JSON and TOML have it: values, step_s, and what `Series` takes.

    Raises:
        ConfigurationError: an entry is missing or unknown, or cannot be right.
    """
    odd = sorted(set(map(str, given)) - set(ARGUMENTS))
    if odd or not {"values", "step_s"} <= set(given):
        wrong = f"has the entry {odd[0]!r}" if odd else "lacks values or step_s"
        raise ConfigurationError(
            f"{name} as a series {wrong}: give values and step_s, and if need be begin_s and repeats."
        )
    try:
        return Series(**given)
    except ConfigurationError as error:
        raise ConfigurationError(f"{name}: {error}") from None


def _again(values: Any, step_s: float, begin_s: float, repeats: bool, source: str, lines: Any) -> Series:
    return Series(values, step_s, begin_s, repeats, source=source, lines=lines)


def _table(values: Any) -> FloatArray:
    """A copy (K, n) of what is given."""
    try:
        table = np.array(values, np.float64)
    except (TypeError, ValueError):
        raise ConfigurationError(f"values = {shown(values, 60)} of a series must be numbers.") from None
    if table.ndim not in (1, 2) or len(table) < 2 or table.size == 0:
        raise ConfigurationError(
            f"values of a series have the shape {table.shape}: give (K,), or (K, n) for n bodies, with at least 2 rows."
        )
    table = table.reshape(len(table), -1)
    wrong = np.argwhere(~np.isfinite(table))
    if len(wrong):
        row, column = wrong[0].tolist()
        raise ConfigurationError(f"values of a series: sample {row}, column {column} is {table[row, column]}.")
    return table
