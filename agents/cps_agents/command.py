"""The script `cps-envs`: the command line, or how to install what it needs."""

from __future__ import annotations

import codecs
import io
import os
import sys
from io import TextIOWrapper
from typing import Any

from cps_agents.surroundings import short_of_memory, wrong_variables

NEEDED = ("typer", "rich", "click")


PLAIN = {"─": "-", "–": "-", "−": "-", "…": "...", "×": "x", "±": "+-", "≥": ">=", "≤": "<=", "°": " deg ", "²": "2"}
DRAWN = "cps-envs.drawn"  # error handler: characters that an encoding does not have become plain ones


def main() -> None:
    """Run the command line; exit code 2 where its packages are missing, or where the shell lets it do nothing."""
    _print_everywhere()
    _outlive_readers()
    for wrong in (short_of_memory(), *wrong_variables(os.environ)):
        if wrong:
            print(f"Error: {wrong}", file=sys.stderr)
            sys.exit(2)
    try:
        from cps_agents.cli import main as run
    except ModuleNotFoundError as error:
        if error.name not in NEEDED:
            raise
        print(
            f'cps-envs needs the package {error.name!r}. Install it with: pip install "cps-envs[cli]"', file=sys.stderr
        )
        sys.exit(2)
    run()


def _print_everywhere() -> None:
    """Print to a pipe or file whose encoding has no lines, as on Windows, instead of ending with an error."""
    codecs.register_error(DRAWN, _in_plain_characters)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=DRAWN)


class Unheard(io.FileIO):
    """A stream whose reader may go away, as `| head` does: what is written then is dropped, and the command goes on."""

    def write(self, data: Any) -> int:
        """Write, or drop it."""
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            return len(data)


def _outlive_readers() -> None:
    """Let every command end as it would have ended, whoever reads its output."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, TextIOWrapper) and isinstance(stream.buffer, (io.BufferedWriter, io.FileIO)):
            stream.flush()
            raw = Unheard(stream.fileno(), "wb", closefd=False)
            kept: dict[str, Any] = {
                "encoding": stream.encoding,
                "errors": stream.errors,
                "line_buffering": stream.line_buffering,
            }
            through = stream.write_through  # as with PYTHONUNBUFFERED
            setattr(sys, name, TextIOWrapper(io.BufferedWriter(raw), write_through=through, **kept))


def _in_plain_characters(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lost = error.object[error.start : error.end]
    return "".join(PLAIN.get(letter, "?") for letter in lost), error.end
