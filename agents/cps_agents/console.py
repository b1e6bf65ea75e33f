"""Where output goes: results to stdout, everything else to stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


def out() -> Console:
    """The console of results."""
    from rich.console import Console

    return Console(highlight=False)


def err() -> Console:
    """The console of progress, notes and errors."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)


def note(line: str) -> None:
    """A line on stderr, as it is."""
    from cps_envs.core.documents import printable

    clean = "\n".join(printable(each) for each in line.split("\n"))  # whatever a file of a stranger put into it
    err().print(clean, markup=False, soft_wrap=True)


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
