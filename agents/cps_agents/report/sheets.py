"""The paper beside ours, as `cps-envs reproduce` makes the tables, and learning curves of training runs.

The curves come from the folders that `cps-envs train` writes.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.table import Table as Printed
from cps_agents.table import plain
from cps_baselines.reproduction.exhibit import Table
from cps_envs.core.documents import DamagedFileError, read_entry


def read_sheets(folders: Sequence[Path]) -> list[dict[str, Any]]:
    """The tables of folders that `cps-envs reproduce ... --csv DIR` has written.

    Raises:
        CommandError: a folder has no such table, or one cannot be read.
    """
    return [_sheet(file) for folder in folders for file in _files(folder)]


def sheets_of(tables: Iterable[Table]) -> list[dict[str, Any]]:
    """The tables of a reproduction."""
    return [
        {
            "title": table.title,
            "headings": table.headings,
            "rows": [list(row) for row in table.rows],
            "left": table.left,
            "notes": list(table.notes),
        }
        for table in tables
    ]


def sheets_of_printed(tables: Iterable[Printed]) -> list[dict[str, Any]]:
    """Tables that a terminal shows."""
    return [
        {
            "title": table.title,
            "headings": list(table.columns),
            "rows": [[plain(cell) for cell in row] for row in table.rows],
            "left": table.left,
            "notes": list(table.caption),
        }
        for table in tables
    ]


def _files(folder: Path) -> list[Path]:
    found = sorted(folder.glob("*.csv"))
    if not found:
        raise CommandError(
            f"--paper {folder}: there are no CSV files. Write them: cps-envs reproduce ch5 --csv {folder}"
        )
    return found


def _sheet(path: Path) -> dict[str, Any]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            headings, *rows = list(csv.reader(file))
    except (OSError, ValueError) as error:
        raise CommandError(f"--paper: {path} is no table ({error}). Write it again with cps-envs reproduce") from error
    return {"title": path.stem.replace("_", " "), "headings": headings, "rows": rows, "left": 1, "notes": []}


EVALUATIONS, RUN = "evaluations.jsonl", "run.json"
MOST_POINTS = 200


def read_curves(folders: Sequence[Path]) -> list[dict[str, Any]]:
    """One curve for each run below the folders: steps, and the validation score beside them.

    Raises:
        CommandError: a folder holds no run, or a file in it cannot be read.
    """
    return [_curve(run) for folder in folders for run in _runs(folder)]


def _runs(folder: Path) -> Iterator[Path]:
    found = sorted(file.parent for file in folder.rglob(EVALUATIONS))
    if not found:
        raise CommandError(
            f"--runs {folder}: there is no {EVALUATIONS} in it. Give the folder of `cps-envs train --out`"
        )
    yield from found


def _curve(run: Path) -> dict[str, Any]:
    points = _points(run / EVALUATIONS)
    kept = points[:: 1 + len(points) // MOST_POINTS]
    if kept[-1] is not points[-1]:
        kept = [*kept, points[-1]]
    recipe = _recipe(run)
    return {
        "run": run.parent.name or run.name,
        "seed": run.name,
        "problem": str(recipe.get("problem", "")),
        "role": str(recipe.get("role", "")),
        "algorithm": str(recipe.get("algorithm", "")),
        "opponent": str(recipe.get("opponent", "")),
        "steps": [point[0] for point in kept],
        "scores": [point[1] for point in kept],
        "best": max(point[1] for point in points),
    }


def _points(path: Path) -> list[tuple[float, float]]:
    try:
        rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
        points = [(float(row["steps"]), float(row["validation"])) for row in rows]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CommandError(
            f"--runs: {path} cannot be read ({error or type(error).__name__}). Remove the run, or train it again"
        ) from error
    if not points:
        raise CommandError(f"--runs: {path} is empty. Remove the run, or go on training it with --resume")
    return points


def _recipe(run: Path) -> dict[str, Any]:
    try:
        found = read_entry(run / RUN, "run", "Train it again.").plain()
    except (OSError, DamagedFileError):
        return {}  # a curve needs it for its caption only
    recipe = found.get("recipe", {})
    return recipe if isinstance(recipe, dict) else {}
