"""`python -m tools.bench.against FOLDER`: this checkout beside an older one, row by row in turns.

A machine gets slower and faster within minutes. So each row is measured there, here, here, there, and so on, and the
best of each side counts.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.console import out
from cps_agents.errors import CommandError
from cps_agents.files import write_json
from cps_agents.machine import describe
from cps_agents.progress import Progress
from cps_agents.sheet import Sheet
from tools.bench.before import PATH, VALUES
from tools.command import run

PROGRAM = "python -m tools.bench.against"
PACKAGES = (".", "agents", "baselines", "paper")
HERE = Path(__file__).parents[2]


class Side:
    """A process that measures rows in one checkout, by the measures of this one."""

    def __init__(self, folder: Path) -> None:
        path = [*(str(folder / name) for name in PACKAGES), str(HERE)]
        one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "CPS_ENVS_QUIET"), "1")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tools.bench.worker"],
            cwd=folder,
            env=os.environ | one | {"PYTHONPATH": os.pathsep.join(path)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )

    def ask(self, **question: Any) -> Any:
        """The answer of the process, see `worker.work`."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(question) + "\n")
            self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise CommandError("A measuring process ended. What it wrote on stderr says why.")
        return json.loads(line)

    def end(self) -> None:
        """Let the process go."""
        self._process.terminate()
        self._process.wait()


def against(
    folder: Annotated[Path, typer.Argument(help="A checkout, such as of `git worktree add FOLDER f6bcd2d6`.")],
    rounds: Annotated[int, typer.Option(min=1, help="Measure each row so often on each side.")] = 4,
    seconds: Annotated[float, typer.Option(min=0.01, help="Give each measurement so many CPU seconds.")] = 0.25,
    parts: Annotated[list[str] | None, typer.Option("--part", help=f"One of {', '.join(VALUES)}.")] = None,
    publish: Annotated[bool, typer.Option(help="Keep it as the column `before` of `python -m tools.bench`.")] = False,
) -> None:
    """Measure sizes, resets and threads here and in an older checkout, in turns.

    Wants an idle machine, and kernels that are compiled on both sides: the first run compiles them.
    """
    for part in parts or []:
        if part not in VALUES:
            raise CommandError(f"--part {part!r}: there is no such part. Take one of {', '.join(VALUES)}.")
    if not (folder / "cps_envs").is_dir():
        raise CommandError(f"{folder} is no checkout of cps_envs: it has no folder cps_envs.")
    sides = {"before": Side(folder.resolve()), "now": Side(HERE)}
    try:
        rows = [row for row in sides["now"].ask() if row[0] in (parts or VALUES)]
        found = {}
        with Progress("against", len(rows)) as progress:
            for done, (part, name) in enumerate(rows):
                progress.update(done, f"{part}: {name}")
                found[f"{part}: {name}"] = _in_turns(sides, part, name, rounds, seconds)
            progress.update(len(rows), "")
    finally:
        for side in sides.values():
            side.end()
    out().print(_sheet(found))
    if publish:
        commit = subprocess.run(
            ["git", "rev-parse", "--short=8", "HEAD"], cwd=folder, capture_output=True, text=True, check=True
        ).stdout.strip()
        command = f"{PROGRAM} FOLDER --rounds {rounds} --seconds {seconds} --publish"
        write_json(PATH, {"commit": commit, "machine": describe(PROGRAM) | {"command": command}, "rows": found})


def _in_turns(sides: dict[str, Side], part: str, name: str, rounds: int, seconds: float) -> dict[str, float]:
    """The best value of each side that has this row."""
    value, best = VALUES[part]
    seen: dict[str, list[float]] = {side: [] for side in sides}
    for turn in range(rounds):
        for side in sorted(sides, reverse=turn % 2 == 1):
            found = sides[side].ask(part=part, name=name, seconds=seconds)
            if found is not None:
                seen[side].append(found[value])
    return {side: best(values) for side, values in seen.items() if values}


def _sheet(found: dict[str, dict[str, float]]) -> Sheet:
    rows = []
    for name, values in found.items():
        before, now = (values.get(side) for side in ("before", "now"))
        times = f"{now / before:.2f}" if before and now else "-"
        rows.append((name, *("-" if value is None else f"{value:.3g}" for value in (before, now)), times))
    return Sheet("Before and now: ns a substep, us a reset, gain of threads", ("", "before", "now", "ratio"), rows)


if __name__ == "__main__":
    run(against, PROGRAM)
