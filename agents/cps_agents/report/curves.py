"""Learning curves of training runs, from the folders that `cps-envs train` writes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from cps_agents.errors import CommandError
from cps_envs.core.documents import DamagedFileError, read_entry

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
