"""What all readings of the dissertation come to: verdicts counted, and claims whose verdict depends on the reading."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from cps_baselines.reproduction.findings import CLAIMS
from cps_baselines.reproduction.verdicts import VERDICTS

Finished: TypeAlias = Mapping[str, Any]  # `chapter`, `reading`, `tallies`, `passed`, `wall_s`, ...
COUNTED = ("chapter", "reading", "statements", *VERDICTS)
DEPENDING = ("chapter", "claim", "verdicts")
NONE = "-"


def counted(every: Sequence[Finished]) -> list[list[str]]:
    """A row for each reading and kind of statement: how many got which verdict."""
    return [
        [f"{each['chapter']}", tally["reading"], tally["kind"], *_counts(tally)]
        for each in every
        for tally in each["tallies"]
        if tally["verdicts"]
    ]


def depending(every: Sequence[Finished]) -> list[list[str]]:
    """The claims that different readings of the same chapter judge differently."""
    return [
        [chapter, name, "; ".join(f"{reading}: {verdict}" for reading, verdict in verdicts.items())]
        for chapter, name, verdicts in _claims(every)
        if len(set(verdicts.values())) > 1
    ]


def failed(every: Sequence[Finished]) -> list[str]:
    """The readings in which our own numbers have left their reference."""
    return [each["reading"] for each in every if not each["passed"]]


def _counts(tally: Mapping[str, Any]) -> list[str]:
    counts = Counter(tally["verdicts"].values())
    return [str(counts[word]) if counts[word] else NONE for word in VERDICTS]


def _claims(every: Sequence[Finished]) -> Iterator[tuple[str, str, dict[str, str]]]:
    """Chapter, claim, and the verdict by reading."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for each in every:
        for tally in each["tallies"]:
            if tally["kind"] == CLAIMS:
                for name, verdict in tally["verdicts"].items():
                    found.setdefault((each["chapter"], name), {})[tally["reading"]] = verdict
    for (chapter, name), verdicts in found.items():
        yield chapter, name, verdicts
