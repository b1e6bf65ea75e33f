"""The generated page docs/chapters.md: what the dissertation describes, and where it lives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import groupby

from cps_paper.printed.items import Item, Place, items

HEAD = """# From the dissertation to the software

<!-- Written by `make docs` from paper/cps_paper/printed/items.csv; do not edit. -->

What the chapters describe, and where to find it. Options are fields of a problem's configuration:
`gymnasium.make(id, option=...)`. Tests check that every place exists, and that no numbered figure, table or algorithm
is left out.
"""
TITLES = {
    2: "Chapter 2: disbanding platoons",
    3: "Chapter 3: false data injection",
    4: "Chapter 4: falsified temperatures",
    5: "Chapter 5: a rogue vehicle",
}
SHOWN: Mapping[str, Callable[[str], str]] = {
    "command": lambda name: f"`cps-envs {name}`",
    "env": lambda name: f"environment `{name}`",
    "file": lambda name: f"[{name}](../{name})",
    "missing": lambda name: f"**not here**: {name}",
    "option": lambda name: f"{name.partition('.')[0]}, option `{name.partition('.')[2]}`",
    "policy": lambda name: f"{' '.join(name.split('.')[:2])} `{name.split('.')[2]}`",
    "preset": lambda name: f"{name.partition('.')[0]}, preset `{name.partition('.')[2]}`",
    "reproduce": lambda name: f"`cps-envs reproduce {name.split()[0]}`, part {' '.join(name.split()[1:]) or 'all'}",
}


def render() -> str:
    """The page."""
    return "\n".join([HEAD, *_chapters()]).rstrip() + "\n"


def _chapters() -> Iterator[str]:
    for chapter, group in groupby(items(), key=lambda item: item.chapter):
        yield f"## {TITLES[chapter]}\n\n| in the text | what it is | where it lives |\n|---|---|---|"
        yield "\n".join(map(_row, group)) + "\n"


def _row(item: Item) -> str:
    return f"| {item.name} | {item.says} | {'; '.join(map(_shown, item.places))} |"


def _shown(place: Place) -> str:
    return SHOWN[place.kind](place.name)
