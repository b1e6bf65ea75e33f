"""Finished work on disk, so that a run that was interrupted goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import agents.zoo
import baselines
import cps_envs
from agents.benchmark.cell import Job, Result, file_name, plain
from agents.console import to_json
from agents.files import write_json
from agents.machine import versions
from agents.zoo.files import SHIPPED
from cps_envs import PROBLEMS

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
            kept = json.loads(self._path(job).read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None
        expected = self._described(job)
        if not isinstance(kept, dict) or any(kept.get(name) != value for name, value in expected.items()):
            return None
        return kept["result"] if kept.get("digest") == _digest(kept.get("result")) else None

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
    for package in (cps_envs, baselines, agents.zoo):
        root = Path(next(iter(package.__path__)))
        found = (file for pattern in SOURCES for file in root.rglob(pattern))
        for file in sorted(file for file in found if not file.is_relative_to(SHIPPED)):
            place = file.relative_to(root)
            if place.parts[0] in others or place.name == DECLARATION:
                continue
            digest.update(place.as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
