"""A part of a command's work, where the same command runs several times on a shared folder: `--part 2/16`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from cps_agents.errors import CommandError

WRITTEN = re.compile(r"([1-9]\d{0,8})/([1-9]\d{0,8})", re.ASCII)
Item = TypeVar("Item")


@dataclass(frozen=True)
class Part:
    """Every `of`-th piece of work, from the `number`-th on."""

    number: int = 1
    of: int = 1

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    def share(self, items: Sequence[Item]) -> list[Item]:
        """Its items. The parts of the same items have each of them once."""
        return list(items[self.number - 1 :: self.of])


WHOLE = Part()


def parse_part(text: str) -> Part:
    """A part as it is written, such as 2/16.

    Raises:
        CommandError: it is none.
    """
    found = WRITTEN.fullmatch(text)
    if found is None or int(found[1]) > int(found[2]):
        raise CommandError(f"--part {text!r}: write which part of how many, such as 2/16, from 1/16 to 16/16")
    return Part(int(found[1]), int(found[2]))


class Unfinished(Exception):  # noqa: N818
    """The part is done, and others are not, so that there is no result yet."""

    def __init__(self, part: Part, what: str, missing: int) -> None:
        super().__init__(
            f"Part {part} is done. The other parts have {missing} of the {what} left: whichever ends last gives the "
            "results, and so does the same command without --part."
        )
        self.missing = missing
