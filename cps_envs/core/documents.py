"""Files and JSON from outside: how large and how deep they may be, and one sentence about what is wrong with them."""

from __future__ import annotations

import json
import math
import re
import stat
import sys
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

MOST_BYTES = 64 * 2**20  # of a document
SHORT_NUMBER = re.compile(r"[+-]?(\.[0-9]+|[0-9]+\.)([eE][+-]?[0-9]+)?")  # Python's, not JSON's
MOST_INSIDE = 5 * 10**5  # lists and objects of a document, counted before it is read as JSON
MOST_VALUES = 4 * 10**6  # commas, likewise; and cells of a table, tags of XML
MOST_DEPTH = 60  # of lists and objects inside one another
TURNING = frozenset(map(chr, (*range(0x202A, 0x202F), *range(0x2066, 0x206A))))  # the direction of writing
SHOWN = 40  # characters of a wrong value
Json: TypeAlias = "dict[str, Json] | list[Json] | str | int | float | bool | None"


class DamagedFileError(ValueError):
    """A document that is not what it should be; the message names it, the place in it and the remedy."""


@dataclass(frozen=True)
class Source:
    """Where a document comes from, for messages."""

    name: str  # of the file
    kind: str  # what it should be, such as "result of `cps-envs league`"
    remedy: str  # a sentence

    def error(self, reason: object) -> DamagedFileError:
        """What to raise."""
        return DamagedFileError(f"{self.name} is no {self.kind} ({reason}). {self.remedy}")


@dataclass(frozen=True)
class Entry:
    """A value in a document; it is read as what it should be, or refused with its place, such as `rows[3].bound`.

    Every method raises DamagedFileError where the value is something else.
    """

    value: Json
    source: Source
    place: str = ""

    def __getitem__(self, name: str) -> Entry:
        """An entry of an object."""
        found = self.get(name)
        if found is None:
            raise self.source.error(f"the entry {self._below(name)} is missing")
        return found

    def get(self, name: str) -> Entry | None:
        """An entry of an object; None if it has no such entry."""
        return self.entries().get(name)

    def entries(self) -> dict[str, Entry]:
        """The entries of an object."""
        if not isinstance(self.value, dict):
            raise self.error("an object")
        return {name: Entry(value, self.source, self._below(name)) for name, value in self.value.items()}

    def rows(self) -> list[Entry]:
        """The values of a list."""
        if not isinstance(self.value, list):
            raise self.error("a list")
        return [Entry(value, self.source, f"{self.place}[{row}]") for row, value in enumerate(self.value)]

    def numbers(self, count: int) -> list[float]:
        """A list of so many finite numbers."""
        found = self.rows()
        if len(found) != count:
            raise self.source.error(f"{self.place or 'it'} has {len(found)} values, but should have {count}")
        return [each.number() for each in found]

    def number(self, low: float = -math.inf, high: float = math.inf) -> float:
        """A finite number in [low, high]."""
        value = self.value
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error("a number")
        if not (abs(value) <= sys.float_info.max and low <= value <= high):
            raise self.error("a finite number" if low == -math.inf else f"a number from {low:g} to {high:g}")
        return float(value)

    def whole(self, low: int, high: int) -> int:
        """A whole number in [low, high]."""
        if type(self.value) is not int or not low <= self.value <= high:
            raise self.error(f"a whole number from {low} to {high}")
        return self.value

    def text(self, choices: Sequence[str] = ()) -> str:
        """A text, perhaps of lines, without characters that steer a terminal; one of `choices` if there are any."""
        if not isinstance(self.value, str) or (choices and self.value not in choices):
            raise self.error(f"one of {', '.join(choices)}" if choices else "a text")
        bare = self.value.replace("\n", " ").replace("\t", " ")  # which steer nothing
        if (clean := printable(bare)) != bare:
            raise self.source.error(f"{self.place or 'it'} has characters that steer a terminal, in {clean[:SHOWN]!r}")
        return self.value

    def plain(self) -> dict[str, Any]:
        """An object as it is."""
        if not isinstance(self.value, dict):
            raise self.error("an object")
        return self.value

    def error(self, wanted: str) -> DamagedFileError:
        """What to raise where something else is wanted here."""
        shown = str(self.value)
        shown = shown if len(shown) <= SHOWN else f"{shown[:SHOWN]}..."
        return self.source.error(f"{self.place or 'it'} is {shown!r}, but should be {wanted}")

    def _below(self, name: str) -> str:
        return f"{self.place}.{name}" if self.place else name


def read_entry(path: Path, kind: str, remedy: str, most_bytes: int = MOST_BYTES) -> Entry:
    """The document of a JSON file.

    Raises:
        DamagedFileError: it is too large, no JSON, or nested too deeply.
        OSError: it cannot be read.
    """
    source = Source(str(path), kind, remedy)
    try:
        return Entry(parse(_decoded(read_bytes(path, most_bytes))), source)
    except ValueError as error:
        raise source.error(error) from error


def entry_of(text: str, source: Source) -> Entry:
    """The document of a JSON text.

    Raises:
        DamagedFileError: it is no JSON, or nested too deeply.
    """
    try:
        return Entry(parse(text), source)
    except ValueError as error:
        raise source.error(error) from error


def read_toml(path: Path, kind: str, remedy: str, most_bytes: int = MOST_BYTES) -> Entry:
    """The document of a TOML file.

    Raises:
        DamagedFileError: it is too large, no TOML, nested too deeply, or has values that JSON does not have, such as
            dates and NaN.
        OSError: it cannot be read.
    """
    source = Source(str(path), kind, remedy)
    try:
        found = tomllib.loads(_decoded(read_bytes(path, most_bytes)).removeprefix("\ufeff"))
        if _is_deep(found):
            raise ValueError("it is nested too deeply")
    except RecursionError as error:
        raise source.error("it is nested too deeply") from error
    except ValueError as error:
        raise source.error(error) from error
    _check_json(Entry(found, source))
    return Entry(found, source)


def _check_json(entry: Entry) -> None:
    """That a document has only what JSON can have."""
    inner = entry.entries().values() if isinstance(entry.value, dict) else ()
    for each in entry.rows() if isinstance(entry.value, list) else inner:
        _check_json(each)
    if isinstance(entry.value, float) and not math.isfinite(entry.value):
        raise entry.error("a finite number")
    if not isinstance(entry.value, (dict, list, str, int, float, bool)):
        raise entry.error("a number, a text, true or false, or a list of them")


def read_text(path: Path, most_bytes: int = MOST_BYTES) -> str:
    """A text file.

    Raises:
        DamagedFileError: it is too large, or no text.
        OSError: it cannot be read.
    """
    try:
        return _decoded(read_bytes(path, most_bytes)).replace("\r\n", "\n")
    except ValueError as error:
        raise DamagedFileError(f"{path} cannot be read as text ({error})") from error


def read_bytes(path: Path, most_bytes: int) -> bytes:
    """A file's content.

    Raises:
        ValueError: it is a folder, a pipe or too large; nothing has been read then.
        OSError: it cannot be read.
    """
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise ValueError("it is no file")
    if status.st_size > most_bytes:
        raise ValueError(f"it has {status.st_size} bytes, more than {most_bytes}")
    with path.open("rb") as file:
        return file.read(most_bytes)


def typed(text: str) -> Any:
    """A value that somebody typed: JSON, a number such as `.5`, True or False; a string where it is none of these.

    Raises:
        ValueError: JSON that is nested too deeply, or a number that JSON does not have.
    """
    try:
        return parse(text)
    except json.JSONDecodeError:
        return float(text) if SHORT_NUMBER.fullmatch(text) else {"True": True, "False": False}.get(text, text)


def parse(text: str) -> Any:
    """JSON as Python's values. The numbers NaN and Infinity, which JSON does not have, are refused.

    Raises:
        json.JSONDecodeError: it is no JSON.
        ValueError: it is nested too deeply, has too many values, or has such a number.
    """
    check_count(text, "[{", "lists and objects", MOST_INSIDE)
    check_count(text, ",", "values")
    try:
        found = json.loads(text, parse_constant=_refuse)
    except RecursionError:
        found = None
        too_deep = True
    else:
        too_deep = _is_deep(found)
    if too_deep:
        raise ValueError("it is nested too deeply")
    return found


def check_count(text: str, marks: str, what: str, most: int = MOST_VALUES) -> None:
    """That a text has no more of these marks than can be read within seconds.

    Raises:
        ValueError: it has.
    """
    count = sum(map(text.count, marks))
    if count > most:
        raise ValueError(f"it has {count} {what}, more than {most}")


def printable(value: Any) -> Any:
    """JSON data whose texts, names of entries too, have lost what would steer a terminal instead of being read."""
    if isinstance(value, str):
        if value.isprintable():
            return value
        return "".join(letter for letter in value if unicodedata.category(letter) != "Cc" and letter not in TURNING)
    if isinstance(value, dict):
        return {printable(name): printable(each) for name, each in value.items()}
    return [printable(each) for each in value] if isinstance(value, list) else value


def _decoded(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"it is no text in UTF-8: {error.reason} at byte {error.start}") from error


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _is_deep(value: Json) -> bool:
    level = [value]
    for _ in range(MOST_DEPTH):
        level = [inner for outer in level for inner in _inside(outer) if isinstance(inner, (dict, list))]
        if not level:
            return False
    return True


def _inside(value: Json) -> Sequence[Json]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else ()
