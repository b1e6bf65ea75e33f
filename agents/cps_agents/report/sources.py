"""What a report reads from outside: learning curves of `cps-envs train`, and tables of `cps-envs reproduce`."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_agents.sheet import Sheet
from cps_envs.core.documents import DamagedFileError, Source, entry_of, read_entry, read_text

EVALUATIONS, RUN = "evaluations.jsonl", "run.json"
MOST_POINTS = 200  # of a curve


def read_sheets(folders: Sequence[Path]) -> list[Sheet]:
    """The tables of folders that `cps-envs reproduce ... --csv DIR` has written.

    Raises:
        CommandError: a folder has no such table, or one cannot be read.
    """
    return [_sheet(file) for folder in folders for file in _files(folder)]


def _files(folder: Path) -> list[Path]:
    found = sorted(folder.glob("*.csv"))
    if not found:
        raise CommandError(
            f"--paper {folder}: there are no CSV files. Write them: cps-envs reproduce ch5 --csv {folder}"
        )
    return found


def _sheet(path: Path) -> Sheet:
    try:
        rows = list(csv.reader(StringIO(read_text(path))))
        if not rows:
            raise ValueError("it is empty")
    except (OSError, ValueError, csv.Error) as error:
        raise CommandError(f"--paper: {path} is no table ({error}). Write it again with cps-envs reproduce") from error
    return Sheet(path.stem.replace("_", " "), rows[0], rows[1:])


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
    remedy = "Remove the run, or train it again."
    points = []
    try:
        for number, line in enumerate(read_text(path).splitlines(), start=1):
            if line.strip():
                row = entry_of(line, Source(f"--runs: {path}, line {number},", "evaluation of a training run", remedy))
                points.append((row["steps"].number(), row["validation"].number()))
    except DamagedFileError as error:
        raise CommandError(str(error) if remedy in str(error) else f"--runs: {error}. {remedy}") from error
    except OSError as error:
        raise CommandError(f"--runs: {path} cannot be read ({error}). {remedy}") from error
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
