"""The page of the documentation: what was tried, how often, and what came out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.machine import describe
from tools.reliability.chunk import PARTS, find_part
from tools.reliability.suite import Findings

Document = dict[str, Any]
PROGRAM = "python -m tools.reliability"
HEAD = f"""# Reliability

This page says how hard we tried to break the package, and what came out. The command below runs every trial again.

```
{PROGRAM} --minutes 120 --publish
```

It takes about an hour and a half of one core, and keeps each finished piece in `results/reliability/`. So you can stop
it and go on at any time. `--jobs 2` does two pieces at once. `python3.10` to `python3.14` are compared where they are
on the path with the packages that we need. The command ends with exit code 1 if anything happened that must not happen.
Each section names the columns that have to stay zero. A piece counts for the code that it ran with: after a change of
that code the command does it again.

Each row names the commit that it was run with; a plus sign means that it had changes which were not committed. Rows may
be of different commits, since publishing renews only what was run.
"""


def document(found: Sequence[Findings]) -> Document:
    """What is known, as plain data."""
    machine = describe(PROGRAM)
    runs_on = f"{machine['cores']} cores of {machine['cpu']}, Python {machine['python']}"
    return {
        "command": machine["command"],
        "parts": {each.part.name: _plain(each, runs_on) for each in found if each.results},
    }


def _plain(found: Findings, machine: str) -> Document:
    part = found.part
    origins = {
        row: {
            "commits": sorted({each["commit"] for each in found.results if each["row"] == row}),
            "date": max(each["date"] for each in found.results if each["row"] == row),
            "machine": machine,
        }
        for row in found.rows
    }
    return {
        "title": part.title,
        "about": part.about,
        "columns": dict(part.columns),
        "forbidden": [name for name in part.columns if name in part.forbidden],
        "rows": {row: {**counts, **origins[row]} for row, counts in found.rows.items()},
        "examples": found.examples,
        "lines": list(dict.fromkeys(line for result in found.results for line in result.get("lines", []))),
    }


def publish(new: Document, root: Path) -> list[Path]:
    """Renew the page and its data below `root` for the rows of the document; the others stay. Returns their paths.

    Raises:
        CommandError: this is not the folder of the repository.
    """
    data, page = root / "docs" / "reliability.json", root / "docs" / "reliability.md"
    if not data.parent.is_dir():
        raise CommandError("there is no folder docs here: publish from the folder of the repository")
    before = json.loads(data.read_text(encoding="utf-8"))["parts"] if data.is_file() else {}
    known = {**before, **{name: _beside(name, part, before.get(name)) for name, part in new["parts"].items()}}
    kept = {"parts": {name: known[name] for name in PARTS if name in known}}
    write_json(data, kept)
    write_text(page, markdown(kept))
    return [data, page]


def _beside(name: str, new: Document, old: Document | None) -> Document:
    """A part with the rows that were not done again, as far as they are still tried."""
    rows = {**(old["rows"] if old else {}), **new["rows"]}
    tried = dict.fromkeys(chunk.row for chunk in find_part(name).chunks())
    return {**new, "rows": {row: rows[row] for row in (tried | new["rows"]) if row in rows}}


def markdown(whole: Document) -> str:
    """The page."""
    return "\n".join([HEAD, *map(_section, whole["parts"].values())])


def _section(part: Document) -> str:
    columns, rows = part["columns"], part["rows"]
    totals = {name: sum(row.get(name, 0) for row in rows.values()) for name in columns}
    lines = [f"## {part['title']}", "", part["about"], ""]
    lines += ["| |" + "".join(f" {heading} |" for heading in columns.values()) + " commit |"]
    lines += ["|---|" + "---:|" * len(columns) + "---|"]
    for name, row in [*rows.items(), *([("**in all**", totals)] if len(rows) > 1 else [])]:
        commits = ", ".join(f"`{commit}`" for commit in row.get("commits", []))
        lines.append(f"| {name} |" + "".join(f" {row.get(key, 0):,.0f} |" for key in columns) + f" {commits} |")
    lines += ["", f"These columns have to stay zero: {', '.join(columns[name] for name in part['forbidden'])}.", ""]
    lines += [f"- {line}" for line in part["lines"]]
    if part["examples"]:
        lines += ["", "Counterexamples:", "", *(f"- {' '.join(line.split())}" for line in part["examples"])]
    dates, machines = ({row[key] for row in rows.values()} for key in ("date", "machine"))
    when = " to ".join(dict.fromkeys([min(dates), max(dates)]))
    return "\n".join([*lines, "", f"{when}, on {'; '.join(sorted(machines))}.", ""])
