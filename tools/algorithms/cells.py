"""Cells of the table: each trained and scored once, and kept in a file of lines, so that a run goes on."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tools.algorithms.learners import ALGORITHMS, Curve, Job

ROLES = (
    *("DisbandingAttack", "DisbandingDefense", "FdiAttack", "FdiDefense"),
    *("HvacAttack", "HvacDefense", "RogueAttack", "RogueDefense"),
)


@dataclass(frozen=True)
class Cell:
    """What became of an algorithm on a track with a training seed."""

    algorithm: str
    role: str
    seed: int
    cpu_s: float  # of training
    score: float  # on split test, in whose sight nothing was chosen
    half_width: float
    curve: Curve
    failed: str = ""  # why there is no score

    @property
    def key(self) -> tuple[str, str, int, float]:
        """What makes it this cell."""
        return self.algorithm, self.role, self.seed, self.cpu_s


def track_of(role: str) -> str:
    """Such as rogue-attack of RogueAttack."""
    return "".join(f"-{letter.lower()}" if letter.isupper() else letter for letter in role).lstrip("-")


def kept(path: Path) -> dict[tuple[str, str, int, float], Cell]:
    """The cells of a file; a line that was cut off is left out."""
    found: dict[tuple[str, str, int, float], Cell] = {}
    for line in path.read_text().splitlines() if path.is_file() else ():
        try:
            fields: dict[str, Any] = json.loads(line)
        except json.JSONDecodeError:
            continue
        cell = Cell(**{**fields, "curve": [(cpu_s, value) for cpu_s, value in fields["curve"]]})
        found[cell.key] = cell
    return found


def wanted(algorithms: list[str], roles: list[str], seeds: int, cpu_s: float) -> Iterator[tuple[str, Job]]:
    """Every cell, seed after seed, so that what is there early covers the table."""
    for seed in range(seeds):
        for role in roles:
            for name in algorithms:
                yield name, Job(role, seed, cpu_s, Path("runs/algorithms") / name / f"{role}-{seed}")


def play(name: str, job: Job) -> Cell:
    """Train and score."""
    import cps_agents
    from cps_envs import trust

    trust()  # models of stable-baselines3 that this process has written itself
    try:
        reference, curve = ALGORITHMS[name].train(job)
        found = cps_agents.score(track_of(job.role), reference)
    except (ValueError, TypeError) as error:
        return Cell(name, job.role, job.seed, job.cpu_s, float("nan"), 0.0, [], str(error))
    values = round(found.estimate.mean, 2), round(found.half_width, 2)
    return Cell(name, job.role, job.seed, job.cpu_s, *values, curve)


def run(path: Path, algorithms: list[str], roles: list[str], seeds: int, cpu_s: float) -> None:
    """Fill the file with the cells that it lacks; one line tells of each."""
    for name, job in wanted(algorithms, roles, seeds, cpu_s):
        if (name, job.role, job.seed, cpu_s) in kept(path):
            continue
        begun = time.monotonic()
        cell = play(name, job)
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a") as file:
            file.write(json.dumps(asdict(cell)) + "\n")
        said = cell.failed or f"{cell.score:.1f} ± {cell.half_width:.1f}"
        print(f"{name:16} {job.role:18} seed {job.seed}: {said} ({time.monotonic() - begun:.0f} s)", flush=True)
