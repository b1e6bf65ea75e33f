"""Tables of measured quantities from files: a column of times, the others named as fields that take a series."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.declare.series import EVEN, Series
from cps_envs.core.documents import MOST_BYTES, MOST_VALUES, check_count, read_bytes
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.types import FloatArray, IntArray

TIME = "time_s"
SHIPPED = Path(__file__).parents[2] / "data"  # series that come along
KINDS = (".csv", ".csv.gz", ".parquet")
MOST_COLUMNS = 1000


class Table(NamedTuple):
    """The numbers of a file."""

    names: tuple[str, ...]
    numbers: FloatArray  # (K, len(names))
    lines: IntArray  # (K,) of the file
    word: str  # what its lines are called


def read_traces(path: str | Path, units: Mapping[str, str]) -> dict[str, Series]:
    """The series of a file by field: a column `time_s`, and columns named as the fields of `units` (name -> unit).

    A column is of all bodies, or with a number, as `internal_heat_w_2`, of one of them, counted from 1; then all up to
    the largest number have to be there. Times are even; lines that begin with # are comments. CSV may be gzipped.
    Parquet needs pyarrow.

    Raises:
        ConfigurationError: the file cannot be read, or a line or column in it cannot be right; the message names both.
    """
    path = Path(path)
    table = read_table(path)
    for name in table.names:
        if name != TIME:
            _check_name(path, name, units)
    if TIME not in table.names:
        raise ConfigurationError(f"{path} has no column {TIME!r}: name the times so, in seconds; {_listed(table)}.")
    step_s, begin_s = even_times(path, table)
    found = {}
    for field, places in _by_field(table, units).items():
        if places != list(range(1, len(places) + 1)) and places != [0]:
            raise ConfigurationError(
                f"{path} numbers the columns of {field} {', '.join(map(str, places))}: give one without a number, or "
                "1, 2, ... up to the last."
            )
        columns = [table.names.index(f"{field}_{place}" if place else field) for place in places]
        found[field] = Series(table.numbers[:, columns], step_s, begin_s, source=path.name, lines=table.lines)
    if not found:
        raise ConfigurationError(f"{path} has times only: name a column as one of {', '.join(sorted(units))}.")
    return found


def _by_field(table: Table, units: Mapping[str, str]) -> dict[str, list[int]]:
    """The numbers of the columns of each field, ascending; 0 is a column without one."""
    found: dict[str, list[int]] = {}
    for name in table.names:
        if name != TIME:
            field, place = _split(name, units)
            found[field] = sorted([*found.get(field, []), place])
    return found


def _split(name: str, units: Mapping[str, str]) -> tuple[str, int]:
    stem, _, number = name.rpartition("_")
    return (stem, int(number)) if number.isdecimal() and stem in units else (name, 0)


def _check_name(path: Path, name: str, units: Mapping[str, str]) -> None:
    """Raise ConfigurationError for a column that is no field that takes a series."""
    field, _ = _split(name, units)
    if field in units:
        return
    stem = name.rpartition("_")[0]
    for known, unit in units.items():
        if stem and known.rpartition("_")[0] == stem:
            raise ConfigurationError(
                f"{path} has the column {name!r}, but {stem} is in {unit} here: convert it and name it {known!r}."
            )
    raise ConfigurationError(
        f"{path} has the column {name!r}, which is no series of this problem: take it out or rename it. "
        f"{near(name, units)}"
    )


def _check_numbers(path: Path, table: Table) -> None:
    """Raise ConfigurationError where a number is missing."""
    wrong = np.argwhere(~np.isfinite(table.numbers))
    if len(wrong):
        row, column = wrong[0].tolist()
        raise ConfigurationError(
            f"{path}, {table.word} {table.lines[row]}, column {table.names[column]!r}: {table.numbers[row, column]} is "
            "no measured value; fill the gap or cut the file there."
        )


def even_times(path: Path, table: Table) -> tuple[float, float]:
    """Step and first time, s, of the column `time_s`.

    Raises:
        ConfigurationError: a number is missing, there are fewer than two times, or they do not grow evenly.
    """
    _check_numbers(path, table)
    times = table.numbers[:, table.names.index(TIME)]
    if len(times) < 2:
        raise ConfigurationError(f"{path} has {len(times)} {table.word} of numbers; a series needs at least 2.")
    step_s = float(times[-1] - times[0]) / (len(times) - 1)
    steps = np.diff(times)
    usual = float(np.median(steps))
    falls = np.flatnonzero(steps <= 0)
    odd = np.flatnonzero(np.abs(steps - usual) > EVEN * abs(usual))
    if len(falls) or len(odd):
        row = int((falls if len(falls) else odd)[0])
        place = f"{path}, {table.word} {table.lines[row + 1]}, column {TIME!r}"
        if len(falls):
            raise ConfigurationError(f"{place}: {times[row + 1]:g} s comes after {times[row]:g} s; sort the lines.")
        raise ConfigurationError(
            f"{place}: {times[row + 1]:g} s follows {times[row]:g} s, and the usual step is {usual:g} s; fill the gap, "
            "or resample the file to even times."
        )
    return step_s, float(times[0])


def _listed(table: Table) -> str:
    return f"it has {', '.join(repr(name) for name in table.names) or 'no names'}"


def read_table(path: Path) -> Table:
    """The numbers of a file.

    Raises:
        ConfigurationError: it cannot be read, or something in it is no number.
    """
    kind = next((kind for kind in KINDS if path.name.lower().endswith(kind)), "")
    if not kind:
        raise ConfigurationError(f"{path} is no file of series that can be read: save it as {', '.join(KINDS)}.")
    try:
        data = read_bytes(path, MOST_BYTES)
        data = _unpacked(data) if kind == ".csv.gz" else data
    except (OSError, EOFError, ValueError, zlib.error) as error:
        raise ConfigurationError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}.") from None
    return _parquet(path, data) if kind == ".parquet" else _csv(path, data)


def _unpacked(data: bytes) -> bytes:
    with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
        text = file.read(MOST_BYTES + 1)
    if len(text) > MOST_BYTES:
        raise ValueError(f"it unpacks to more than {MOST_BYTES} bytes")
    return text


def _csv(path: Path, data: bytes) -> Table:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path} cannot be read: it is no text in UTF-8 (byte {error.start}).") from None
    try:
        check_count(text, ",\r\n", "cells")
    except ValueError as error:
        raise ConfigurationError(f"{path} cannot be read: {error}.") from None
    kept = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    try:
        rows = list(csv.reader([line for _, line in kept], strict=True))
    except csv.Error as error:
        raise ConfigurationError(f"{path} cannot be read as CSV: {error}.") from None
    if len(rows) != len(kept):
        raise ConfigurationError(f"{path} has a line break inside quotation marks: write each row in one line.")
    if not rows:
        raise ConfigurationError(f"{path} is empty: its first line names the columns, {TIME!r} among them.")
    names, lines = tuple(name.strip() for name in rows[0]), np.array([number for number, _ in kept[1:]], np.int64)
    if len(names) == 1 and len(names[0].split(";")) > 1:
        raise ConfigurationError(f"{path}, line {kept[0][0]}: separate columns by commas, and decimals by a point.")
    _check_header(path, names)
    for line, row in zip(lines, rows[1:], strict=True):
        if len(row) != len(names):
            raise ConfigurationError(f"{path}, line {line} has {len(row)} columns, and the first {len(names)}.")
    try:
        numbers = np.array(rows[1:], np.float64).reshape(-1, len(names))
    except ValueError:
        raise _no_number(path, names, lines, rows[1:]) from None
    return Table(names, numbers, lines, "line")


def _no_number(path: Path, names: Sequence[str], lines: IntArray, rows: Sequence[Sequence[str]]) -> ConfigurationError:
    """What to raise for the first cell that is no number."""
    for line, row in zip(lines, rows, strict=True):
        for name, cell in zip(names, row, strict=True):
            try:
                float(cell)
            except ValueError:
                wrong = "is empty; fill the gap or cut the file there" if not cell.strip() else f"{cell!r} is no number"
                return ConfigurationError(f"{path}, line {line}, column {name!r}: {wrong}.")
    raise AssertionError("every cell is a number")


def _check_header(path: Path, names: Sequence[str]) -> None:
    if len(names) > MOST_COLUMNS:
        raise ConfigurationError(f"{path} has {len(names)} columns, more than {MOST_COLUMNS}.")
    for name in names:
        if not name or names.count(name) > 1:
            wrong = f"the column {name!r} twice" if name else "a column without a name"
            raise ConfigurationError(f"{path} has {wrong}: name each column once, in the first line.")


def _parquet(path: Path, data: bytes) -> Table:
    try:
        from pyarrow import BufferReader, lib, parquet
    except ImportError:
        raise ConfigurationError(f"{path} needs the package pyarrow: install it, or save the table as CSV.") from None
    try:
        about = parquet.read_metadata(BufferReader(data))
        if about.num_rows * about.num_columns > MOST_VALUES:  # a few bytes may say how to make that many
            raise ConfigurationError(f"{path} has {about.num_rows * about.num_columns} cells, more than {MOST_VALUES}.")
        read: Any = parquet.read_table(BufferReader(data))
    except (lib.ArrowException, OSError) as error:
        raise ConfigurationError(f"{path} cannot be read as Parquet: {str(error).splitlines()[0]}.") from None
    names = tuple(read.column_names)
    _check_header(path, names)
    columns = []
    for name in names:
        try:
            columns.append(np.asarray(read[name].to_numpy(), np.float64))
        except (TypeError, ValueError):
            raise ConfigurationError(f"{path}, column {name!r}: it does not hold numbers.") from None
    return Table(names, np.stack(columns, axis=1), np.arange(1, read.num_rows + 1), "row")
