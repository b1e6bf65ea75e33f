"""What all readings of the dissertation come to: verdicts counted, and claims whose verdict depends on the reading.

`publish` puts them into the repository: `docs/reproduction.json` and `docs/reproduction.md`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.sheet import Sheet
from cps_envs.core.documents import Entry, read_entry, read_text
from cps_paper.claims import CLAIMS
from cps_paper.verdicts import VERDICTS

Finished: TypeAlias = Mapping[str, Any]  # `chapter`, `reading`, `tallies`, `passed`, `wall_s`, ...
COUNTED = ("chapter", "reading", "statements", *VERDICTS)
DEPENDING = ("chapter", "claim", "verdicts")
AGAIN = ("chapter", "reading", "judged again", "verdicts that stay", "changed")
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


def judged_again(every: Sequence[Finished]) -> list[list[str]]:
    """A row for each reading and condition of --recheck, from the same run as the other tables."""
    return [
        [
            f"{each['chapter']}",
            row["reading"],
            row["condition"],
            f"{row['judged'] - len(row['changed'])} of {row['judged']}",
            "; ".join(f"{name} {shown}" for name, shown in row["changed"].items()) or NONE,
        ]
        for each in every
        for row in each["again"]
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


START = "<!-- the tables below are written by `cps-envs reproduce all --publish` -->"
END = "<!-- the tables above are written by `cps-envs reproduce all --publish` -->"
KEPT = ("chapter", "reading", "tallies", "again", "passed", "wall_s", "recheck", "command")
PAGE, DATA = Path("docs") / "reproduction.md", Path("docs") / "reproduction.json"


def refuse_older_rechecks(names: Sequence[str], root: Path) -> None:
    """A table has to be published with the claims judged again where they were before: those would be older than it.

    Raises:
        CommandError: `names` are readings to be published without --recheck, and one of them has it.
    """
    for each in _published(root / DATA):
        if (name := each["reading"].text()) in names and each["again"].rows():
            raise CommandError(
                f"the claims of {name} are published as judged again, which would be older than its table: "
                "add --recheck, so that both come from one run"
            )


def publish(every: Sequence[Finished], root: Path, names: Sequence[str]) -> list[Path]:
    """Renew these readings in both files below `root`, whose other readings stay; returns their paths.

    `names` are all readings, in order; what is published of others goes.

    Raises:
        CommandError: no repository of this package.
        DamagedFileError: what is published is no list of readings.
    """
    page, data = root / PAGE, root / DATA
    text = read_text(page) if page.is_file() else ""
    if START not in text or END not in text:
        raise CommandError(f"{page} has no lines {START} and {END}: publish from the repository's folder")
    new = {each["reading"]: {name: each[name] for name in KEPT} for each in every}
    old = {each["reading"].text(): each.plain() for each in _published(data)}
    every_one = {**old, **new}
    kept = [every_one[name] for name in names if name in every_one]
    before, after = text.partition(START)[0], text.partition(END)[2]
    write_json(data, kept)
    write_text(page, f"{before}{START}\n\n{tables(kept)}\n{END}{after}")
    return [page, data]


def _published(data: Path) -> list[Entry]:
    remedy = "Publish all readings anew, without --reading."
    return read_entry(data, "list of published readings", remedy).rows() if data.is_file() else []


def tables(every: Sequence[Finished]) -> str:
    """The summary as Markdown."""
    return "\n".join(
        [
            *Sheet("", COUNTED, counted(every)).markdown(),
            "",
            "Claims whose verdict depends on the reading:",
            "",
            *Sheet("", DEPENDING, depending(every)).markdown(),
            "",
            "Claims judged again in the same run, under other conditions:",
            "",
            *Sheet("", AGAIN, judged_again(every)).markdown(),
            "",
        ]
    )
