"""Finished work on disk: what one command has played, no other one plays again, and an interrupted one goes on."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import cps_agents.zoo
import cps_baselines
import cps_envs
from cps_agents.arena.meeting import Job, Result
from cps_agents.console import to_json
from cps_agents.files import write_json
from cps_agents.machine import versions
from cps_agents.part import WHOLE, Part
from cps_agents.zoo.card import SHIPPED
from cps_agents.zoo.code import hashes_of_code
from cps_envs import PROBLEMS
from cps_envs.core.declare.objective import weights_of
from cps_envs.core.documents import DamagedFileError, read_entry

LONGEST_NAME = 90  # of a file, before its hash
DATA = ("*.py", "*.json", "*.csv")
DECLARATIONS = ("benchmark.py", "panels.py")  # what is played, which each piece of work tells itself


class Store:
    """Results of jobs, one file each, valid as long as neither the job nor the code behind it changes.

    Several processes may use a folder at once: a file is whole or not there. A `fresh` one believes only what it has
    been given itself; what it keeps takes the place of what was there. Of what is asked for, a `part` is done here, and
    the rest by processes that use the same folder.
    """

    def __init__(self, folder: Path, *, fresh: bool = False, part: Part = WHOLE) -> None:
        self.folder, self.part = folder, part
        self._versions = versions()
        self._fresh = fresh
        self._own, self._found = set[Path](), set[Path]()  # kept by this one, and found finished

    def get(self, job: Job) -> Result | None:
        """The result of a job that was done before, or None; a damaged or edited file counts as not there."""
        path = self._path(job)
        if self._fresh and path not in self._own:
            return None
        try:
            found = read_entry(path, "kept result", "It is computed again.")
            kept, result = found.plain(), found["result"]
            if any(kept.get(name) != value for name, value in self._described(job).items()):
                return None
            job.check(result)
        except (OSError, DamagedFileError):
            return None
        if kept.get("digest") != _digest(result.value):
            return None
        self._found.add(path)
        return result.plain()

    def put(self, job: Job, result: Result) -> None:
        """Keep a result."""
        plain, path = json.loads(to_json(result)), self._path(job)
        try:
            write_json(path, {**self._described(job), "digest": _digest(plain), "result": plain})
        except OSError as error:
            remedy = f"{error.strerror}. Finished games are kept there: name another folder with --meetings DIR"
            raise OSError(error.errno, remedy, str(path)) from error
        self._own.add(path)

    @property
    def reused(self) -> int:
        """Jobs whose results were found finished."""
        return len(self._found - self._own)

    @property
    def asked(self) -> int:
        """Jobs whose results were found finished or kept."""
        return len(self._found | self._own)

    def _described(self, job: Job) -> dict[str, Any]:
        """The job, and what its result depends on beside it, as they come back from a file."""
        surroundings = {"versions": self._versions, "sources": fingerprint(job.problem)}
        return {"job": json.loads(to_json(identity(job))), **surroundings}

    def _path(self, job: Job) -> Path:
        return self.folder / file_name(job)


def identity(job: Job) -> dict[str, Any]:
    """All that a job's result depends on, as plain data: a venue counts by its configuration, a label not at all."""
    plain = {"kind": job.kind, **asdict(cast(Any, job))}
    plain.pop("label", None)
    venue = getattr(job, "venue", None)
    if venue is None:
        return plain
    place = {"problem": venue.problem, "config": asdict(venue.config)}
    if isinstance(paid := weights_of(venue.config), str):
        place["payoff_code"] = hashes_of_code([paid.partition(":")[0]])
    return {**plain, "venue": place}


@lru_cache
def fingerprint(problem: str) -> str:
    """A hash of the code and the data that a problem's results depend on, without the trained networks.

    The registered problems know nothing of one another, so a change in one leaves the results of the others valid.
    """
    others = set(PROBLEMS) - {problem} if problem in PROBLEMS else set()
    digest = hashlib.sha256()
    for package in (cps_envs, cps_baselines, cps_agents.zoo):
        root = Path(next(iter(package.__path__)))
        found = (file for pattern in DATA for file in root.rglob(pattern))
        for file in sorted(file for file in found if not file.is_relative_to(SHIPPED)):
            place = file.relative_to(root)
            if place.parts[0] in others or place.name in DECLARATIONS:
                continue
            digest.update(place.as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def file_name(job: Job) -> str:
    """A readable name that is unique to the work."""
    plain = identity(job)
    parts = [plain.get(name, "") for name in ("attacker", "defender", "function", "name")]
    readable = "-".join([job.problem, *(part for part in parts if isinstance(part, str) and part)])
    text = re.sub(r"[^a-z0-9._]+", "-", readable.lower())[:LONGEST_NAME]
    return f"{text}-{hashlib.sha256(to_json(plain).encode()).hexdigest()[:12]}.json"


def _digest(result: Any) -> str:
    """A hash that tells whether a result is the one that was kept."""
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()
