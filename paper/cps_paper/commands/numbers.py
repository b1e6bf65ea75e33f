"""Tables, figures and sections by the number that the dissertation gives them: `cps-envs reproduce 4.2`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from cps_agents.errors import CommandError
from cps_paper.commands.chapters import COMMANDS
from cps_paper.printed.items import Item, items

KINDS = {"table": "Table", "tab": "Table", "figure": "Figure", "fig": "Figure", "section": "Section", "sec": "Section"}
EXHIBITS = ("Table", "Figure", "Section")  # in the order in which a bare number is looked up
NUMBERED = re.compile(r"(?P<kind>[a-z]*\.?)(?P<number>[1-9](?:\.\d+)+)(?P<figure>fig)?", re.IGNORECASE)


def by_number(args: Sequence[str]) -> list[str]:
    """The arguments of `reproduce`, a number of the dissertation replaced by the chapter's command and its part.

    `4.2`, `ch4.2` and `table 4.2` mean Table 4.2; `fig 4.2` and `4.2fig` the figure of this number. Other arguments
    come back as they are.

    Raises:
        CommandError: the dissertation has no such table or figure, or nothing computes it.
    """
    words = list(args)
    apart = bool(words) and _kind(words[0]) is not None  # "table 4.2", in two words
    if apart and len(words) == 1:
        raise CommandError(f"which one? Write for example: cps-envs reproduce {words[0]} 4.2")
    found = NUMBERED.fullmatch("".join(words[: 1 + apart]))
    if found is None:
        return words
    kind = "Figure" if found["figure"] else _kind(found["kind"])
    return [*_command(_item(found["number"], kind)), *words[1 + apart :]]


def _kind(word: str) -> str | None:
    return KINDS.get(word.lower().rstrip("."))


def _item(number: str, kind: str | None) -> Item:
    """The first item of this number: a table before a figure, a figure before a section."""
    kinds = (kind,) if kind else EXHIBITS
    numbered = {each: item for item in items() for each in _numbers(item)}
    for one in kinds:
        if (one, number) in numbered:
            return numbered[one, number]
    near = [f"{one} {each}" for one, each in numbered if each[0] == number[0] and one in kinds]
    listed = f"chapter {number[0]} has {', '.join(near)}" if near else "its chapters with results are 2 to 5"
    raise CommandError(f"the dissertation has no {' or '.join(kinds).lower()} {number} that can be computed: {listed}")


def _numbers(item: Item) -> Iterator[tuple[str, str]]:
    """The kind and number of an item, "Figures 5.6 to 5.11" as six of them."""
    name, _, span = item.name.partition(" ")
    first, _, last = span.partition(" to ")
    if not last:
        yield name, first
        return
    chapter, _, start = first.rpartition(".")
    for place in range(int(start), int(last.rpartition(".")[2]) + 1):
        yield name.rstrip("s"), f"{chapter}.{place}"


def _command(item: Item) -> list[str]:
    """The chapter's command and the part that computes it."""
    for place in item.places:
        if place.kind == "reproduce":
            name, _, part = place.name.partition(" ")
            option = next(each.part_option for each in COMMANDS if each.name == name)
            return [name, *([f"--{option}", part] if part else [])]
    lives = ", ".join(f"{place.kind} {place.name}" for place in item.places)
    raise CommandError(f"no table or figure is computed for {item.name} ({item.says}): it lives in {lives}")
