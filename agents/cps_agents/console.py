"""Where output goes: results to stdout, everything else to stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


def out() -> Console:
    """The console of results."""
    return _console()(highlight=False)


def err() -> Console:
    """The console of progress, notes and errors."""
    return _console()(stderr=True, highlight=False)


@cache
def _console() -> type[Console]:
    """A console on which no text steers the terminal, whatever a file of a stranger, or its name, has in it."""
    from rich.console import Console
    from rich.segment import Segment

    class Clean(Console):
        """Drops control characters from texts, not those that colour them or draw a bar."""

        def render(self, renderable: Any, options: Any = None) -> Iterable[Segment]:
            """The segments of what is printed."""
            for segment in super().render(renderable, options):
                yield segment if segment.control else segment._replace(text=clean(segment.text))

    return Clean


def clean(text: str) -> str:
    """A text of lines without characters that steer a terminal."""
    from cps_envs.core.documents import printable

    return text if text.isascii() and text.isprintable() else "\n".join(map(printable, text.split("\n")))


def note(line: str) -> None:
    """A line on stderr, as it is."""
    err().print(line, markup=False, soft_wrap=True)


def print_json(value: Any) -> None:
    """One JSON document on stdout."""
    sys.stdout.write(to_json(value) + "\n")


def to_json(value: Any) -> str:
    """Indented, strict JSON (no NaN); numpy's scalars and arrays become numbers and lists.

    Series of a configuration are written as what they are, with a digest instead of their values.
    """
    return json.dumps(value, indent=2, allow_nan=False, default=_plain)


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    from cps_envs.core.declare.series import Series

    if isinstance(value, Series):
        return value.to_json()
    raise TypeError(f"{value!r} cannot be written as JSON")


def assignments(pairs: Sequence[str], option: str = "--set", example: str = "tau_s=0.3") -> Mapping[str, Any]:
    """Values of `--set name=value` options, or of another option that is written alike.

    Raises:
        ValueError: a pair without "=", or a value that `typed` refuses.
    """
    from cps_envs.core.documents import typed

    values = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not (name and equals):
            raise ValueError(f"{option} {pair!r}: write it as field=value, for example {option} {example}")
        try:
            values[name.strip()] = typed(text.strip())
        except ValueError as error:
            raise ValueError(f"{option} {name.strip()}=...: {error}") from error
    return values
