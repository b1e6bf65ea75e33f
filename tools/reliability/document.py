"""The page of the documentation: what was tried, how often, and what came out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.machine import describe
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
Each section names the columns that have to stay zero. A piece counts for the commit that it ran with: at another one
the command does it again, and the page is written when all of them are done.
"""


def document(found: Sequence[Findings], commit: str) -> Document:
    """What is known of a commit, as plain data."""
    machine = describe(PROGRAM)
    dates = [result["date"] for each in found for result in each.results]
    return {
        "command": machine["command"],
        "commit": commit,
        "dates": sorted({min(dates), max(dates)}) if dates else [],
        "machine": f"{machine['cores']} cores of {machine['cpu']}, Python {machine['python']}",
        "parts": {each.part.name: _plain(each) for each in found if each.results},
    }


def _plain(found: Findings) -> Document:
    part = found.part
    return {
        "title": part.title,
        "about": part.about,
        "columns": dict(part.columns),
        "forbidden": [name for name in part.columns if name in part.forbidden],
        "rows": found.rows,
        "examples": found.examples,
        "lines": list(dict.fromkeys(line for result in found.results for line in result.get("lines", []))),
    }


def publish(new: Document, root: Path) -> list[Path]:
    """Write the page and its data below `root`: the document of a whole run at one commit. Returns their paths.

    Raises:
        CommandError: this is not the folder of the repository.
    """
    data, page = root / "docs" / "reliability.json", root / "docs" / "reliability.md"
    if not data.parent.is_dir():
        raise CommandError("there is no folder docs here: publish from the folder of the repository")
    write_json(data, new)
    write_text(page, markdown(new))
    return [data, page]


def markdown(whole: Document) -> str:
    """The page."""
    origin = f"All of it is of commit `{whole['commit']}`, {' to '.join(whole['dates'])}, on {whole['machine']}.\n"
    return "\n".join([HEAD, origin, *map(_section, whole["parts"].values())])


def _section(part: Document) -> str:
    columns, rows = part["columns"], part["rows"]
    totals = {name: sum(row.get(name, 0) for row in rows.values()) for name in columns}
    lines = [f"## {part['title']}", "", part["about"], ""]
    lines += ["| |" + "".join(f" {heading} |" for heading in columns.values())]
    lines += ["|---|" + "---:|" * len(columns)]
    for name, row in [*rows.items(), *([("**in all**", totals)] if len(rows) > 1 else [])]:
        lines.append(f"| {name} |" + "".join(f" {row.get(key, 0):,.0f} |" for key in columns))
    lines += ["", f"These columns have to stay zero: {', '.join(columns[name] for name in part['forbidden'])}.", ""]
    lines += [f"- {line}" for line in part["lines"]]
    if part["examples"]:
        lines += ["", "Counterexamples:", "", *(f"- {' '.join(line.split())}" for line in part["examples"])]
    return "\n".join([*lines, ""])
