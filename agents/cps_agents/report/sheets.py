"""The paper beside ours: the tables that `cps-envs reproduce` makes."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.table import Table as Printed
from cps_agents.table import plain
from cps_baselines.reproduction.exhibit import Table


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
