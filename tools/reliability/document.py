"""The page of the documentation: what was tried, how often, and what came out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.files import write_json, write_text
from cps_agents.machine import describe
from tools.reliability.chunk import PARTS
from tools.reliability.suite import Findings

Document = dict[str, Any]
PROGRAM = "python -m tools.reliability"
MACHINE = ("cpu", "cores", "python")
HEAD = """# Reliability

This page says how hard we tried to break the package, and what came out. The command below runs every trial again.

```
{command}
```

It keeps each finished piece in `results/reliability/`. So you can stop it and go on at any time. `--jobs 2` does two
pieces at once. All sections get about the same time. `python3.10` to `python3.14` are compared where they are on the
path with the packages that we need. The command ends with exit code 1 if anything happened that must
not happen. Each section names the columns that have to stay zero. A piece counts for
the code that it ran with: after a change of that code the command does it again. Other words in comments and docstrings
are no change.

Each section says what all its pieces try. The line at its end says how many of them have run.
"""


def document(found: Sequence[Findings]) -> Document:
    """What is known, as plain data."""
    machine = describe(PROGRAM)
    described = {name: machine[name] for name in MACHINE}
    return {
        "command": machine["command"],
        "parts": {each.part.name: {**_plain(each), "machine": described} for each in found if each.results},
    }


def _plain(found: Findings) -> dict[str, Any]:
    part, results = found.part, found.results
    dates = sorted({result["date"] for result in results})
    return {
        "title": part.title,
        "about": part.about,
        "columns": dict(part.columns),
        "forbidden": [name for name in part.columns if name in part.forbidden],
        "rows": found.rows,
        "totals": found.totals,
        "done": len(results),
        "chunks": found.chunks,
        "cpu_s": round(sum(result.get("cpu_s", 0.0) for result in results)),
        "dates": [dates[0], dates[-1]],
        "commits": sorted({result["commit"] for result in results}),
        "examples": found.examples,
        "lines": list(dict.fromkeys(line for result in results for line in result.get("lines", []))),
    }


def publish(new: Document, root: Path) -> list[Path]:
    """Renew the page and its data below `root` for the parts of the document; the others stay. Returns their paths.

    Raises:
        CommandError: this is not the folder of the repository.
    """
    data, page = root / "docs" / "reliability.json", root / "docs" / "reliability.md"
    if not data.parent.is_dir():
        raise CommandError("there is no folder docs here: publish from the folder of the repository")
    before = json.loads(data.read_text(encoding="utf-8")) if data.is_file() else {"parts": {}}
    known = {**before["parts"], **new["parts"]}
    kept = {"parts": {name: known[name] for name in PARTS if name in known}}
    write_json(data, kept)
    write_text(page, markdown(kept))
    return [data, page]


def markdown(whole: Document) -> str:
    """The page."""
    command = f"{PROGRAM} --minutes 120 --publish"
    return "\n".join([HEAD.format(command=command), *map(_section, whole["parts"].values())])


def _section(part: dict[str, Any]) -> str:
    columns = part["columns"]
    lines = [f"## {part['title']}", "", part["about"], ""]
    lines += ["| |" + "".join(f" {heading} |" for heading in columns.values()), "|---|" + "---:|" * len(columns)]
    rows = [*part["rows"].items(), *([("**in all**", part["totals"])] if len(part["rows"]) > 1 else [])]
    lines += [f"| {name} |" + "".join(f" {row.get(key, 0):,.0f} |" for key in columns) for name, row in rows]
    lines += ["", f"These columns have to stay zero: {', '.join(columns[name] for name in part['forbidden'])}.", ""]
    lines += [f"- {line}" for line in part["lines"]]
    if part["examples"]:
        lines += ["", "Counterexamples:", "", *(f"- {' '.join(line.split())}" for line in part["examples"])]
    return "\n".join([*lines, "", _origin(part), ""])


def _origin(part: dict[str, Any]) -> str:
    first, last = part["dates"]
    when = first if first == last else f"{first} to {last}"
    commits = ", ".join(f"`{commit}`" for commit in part["commits"])
    machine = part["machine"]
    return (
        f"{part['done']} of {part['chunks']} pieces, {part['cpu_s']:,} CPU seconds, {when}, commit {commits}, on "
        f"{machine['cores']} cores of {machine['cpu']}, Python {machine['python']}."
    )
