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
MACHINE = ("cpu", "cores", "python")
NOTHING: Document = {"rows": {}, "runs": [], "lines": []}  # of a part that was never published
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
        "parts": {each.part.name: _plain(each, described) for each in found if each.results},
    }


def _plain(found: Findings, machine: dict[str, Any]) -> dict[str, Any]:
    part, results = found.part, found.results
    dates = sorted({result["date"] for result in results})
    run = {
        "rows": list(found.rows),
        "done": len(results),
        "cpu_s": round(sum(result.get("cpu_s", 0.0) for result in results)),
        "dates": [dates[0], dates[-1]],
        "commits": sorted({result["commit"] for result in results}),
        "machine": machine,
    }
    return {
        "title": part.title,
        "about": part.about,
        "columns": dict(part.columns),
        "forbidden": [name for name in part.columns if name in part.forbidden],
        "rows": found.rows,
        "totals": found.totals,
        "chunks": found.chunks,
        "runs": [run],
        "examples": found.examples,
        "lines": list(dict.fromkeys(line for result in results for line in result.get("lines", []))),
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
    known = {
        **before,
        **{name: _beside(name, part, before.get(name, NOTHING)) for name, part in new["parts"].items()},
    }
    kept = {"parts": {name: known[name] for name in PARTS if name in known}}
    write_json(data, kept)
    write_text(page, markdown(kept))
    return [data, page]


def _beside(name: str, new: dict[str, Any], old: dict[str, Any]) -> dict[str, Any]:
    """A part whose rows that were not done again stand below the new ones, with the run that they are of.

    What is no longer tried has no row, and what was never tried is named.
    """
    tried = list(dict.fromkeys(chunk.row for chunk in find_part(name).chunks()))
    older = set(tried) - set(new["rows"])
    runs = [{**run, "rows": [row for row in run["rows"] if row in older]} for run in old["runs"]]
    runs = [run for run in runs if run["rows"]]
    rows = {**new["rows"], **{row: old["rows"][row] for run in runs for row in run["rows"]}}
    return {
        **new,
        "rows": rows,
        "totals": {column: sum(row.get(column, 0) for row in rows.values()) for column in new["columns"]},
        "runs": [*new["runs"], *runs],
        "lines": list(dict.fromkeys([*new["lines"], *(old["lines"] if runs else [])])),
        "untried": [row for row in tried if row not in rows],
    }


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
    if part.get("untried"):
        lines += ["", f"Not tried yet: {', '.join(part['untried'])}."]
    return "\n".join([*lines, "", *_origins(part), ""])


def _origins(part: dict[str, Any]) -> list[str]:
    """Where the rows are from; older ones stand below."""
    last, *before = part["runs"]
    lines = [f"{last['done']} of {part['chunks']} pieces, {_circumstances(last)}"]
    for run in before:
        count = len(run["rows"])
        below = "The row below them is" if count == 1 else f"The {count} rows below them are"
        lines += ["", f"{below} of a run before: {run['done']} pieces, {_circumstances(run)}"]
    return lines


def _circumstances(run: dict[str, Any]) -> str:
    first, last = run["dates"]
    when = first if first == last else f"{first} to {last}"
    commits, machine = ", ".join(f"`{commit}`" for commit in run["commits"]), run["machine"]
    return (
        f"{run['cpu_s']:,} CPU seconds, {when}, commit {commits}, on {machine['cores']} cores of {machine['cpu']}, "
        f"Python {machine['python']}."
    )
