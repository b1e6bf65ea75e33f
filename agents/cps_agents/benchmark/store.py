"""Finished work on disk, so that a run that was interrupted goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import cps_agents.zoo
import cps_baselines
import cps_envs
from cps_agents.benchmark.cell import Job, Result, file_name, plain
from cps_agents.console import to_json
from cps_agents.files import write_json
from cps_agents.machine import versions
from cps_agents.zoo.card import SHIPPED
from cps_envs import PROBLEMS
from cps_envs.core.documents import DamagedFileError, read_entry

SOURCES = ("*.py", "*.json", "*.csv")
DECLARATION = "contest.py"  # what is played, which each piece of work tells itself


class Store:
    """Results of jobs, one file each, valid as long as neither the job nor the code behind it changes."""

    def __init__(self, folder: Path, *, fresh: bool = False) -> None:
        self.folder = folder
        self._versions = versions()
        if fresh and folder.is_dir():
            for file in folder.glob("*.json"):
                file.unlink()

    def get(self, job: Job) -> Result | None:
        """The result of a job that was done before, or None; a damaged or edited file counts as not there."""
        try:
            found = read_entry(self._path(job), "kept result", "It is computed again.")
            kept, result = found.plain(), found["result"]
            if any(kept.get(name) != value for name, value in self._described(job).items()):
                return None
            job.check(result)
        except (OSError, DamagedFileError):
            return None
        return result.plain() if kept.get("digest") == _digest(result.value) else None

    def put(self, job: Job, result: Result) -> None:
        """Keep a result."""
        plain_result = json.loads(to_json(result))
        write_json(self._path(job), {**self._described(job), "digest": _digest(plain_result), "result": plain_result})

    def _described(self, job: Job) -> dict[str, Any]:
        """The job, and what its result depends on beside it, as they come back from a file."""
        return {"job": json.loads(to_json({"kind": job.kind, **plain(job)})), **self._surroundings(job)}

    def _surroundings(self, job: Job) -> dict[str, Any]:
        return {"versions": self._versions, "sources": fingerprint(job.problem)}

    def _path(self, job: Job) -> Path:
        return self.folder / file_name(job)


def _digest(result: Any) -> str:
    """A hash that tells whether a result is the one that was kept."""
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()


@lru_cache
def fingerprint(problem: str) -> str:
    """A hash of the code and the data that a problem's results depend on, without the trained networks.

    The registered problems know nothing of one another, so a change in one leaves the results of the others valid.
    """
    others = set(PROBLEMS) - {problem} if problem in PROBLEMS else set()
    digest = hashlib.sha256()
    for package in (cps_envs, cps_baselines, cps_agents.zoo):
        root = Path(next(iter(package.__path__)))
        found = (file for pattern in SOURCES for file in root.rglob(pattern))
        for file in sorted(file for file in found if not file.is_relative_to(SHIPPED)):
            place = file.relative_to(root)
            if place.parts[0] in others or place.name == DECLARATION:
                continue
            digest.update(place.as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
