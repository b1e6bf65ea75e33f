"""A piece of a reliability run: small enough to be repeated, with a result that adds up with its siblings'."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from tools.reliability.journal import Journal

ROOT = Path(__file__).resolve().parents[2]  # of the source tree
PARTS: Mapping[str, str] = {  # where each part's PART lies
    "fuzz": "tools.reliability.fuzz.part",
    "faults": "tools.reliability.faults.part",
    "load": "tools.reliability.load",
    "determinism": "tools.reliability.determinism",
    "bounds": "tools.reliability.bounds",
}
CODE = ("cps_envs", "baselines/cps_baselines", "agents/cps_agents", "paper/cps_paper")
HERE = "tools/reliability"
READ = (".py", ".json", ".csv")

Result = dict[str, Any]  # counts: a number for each column; examples: a text for each forbidden one; lines: remarks


@dataclass(frozen=True)
class Chunk:
    """One piece of work for a process of its own."""

    part: str
    row: str  # of the part's table, in which the chunks of a row are summed
    number: int = 0  # also its seed
    sources: tuple[str, ...] = CODE  # files and folders that its result depends on
    limit_s: float = 1800.0  # after which the process counts as hanging

    @property
    def name(self) -> str:
        """For files and progress."""
        plain = "".join(letter if letter.isalnum() else "-" for letter in self.row)
        return f"{plain}-{self.number}"


@dataclass(frozen=True)
class Part:
    """A kind of trial: its table, its pieces, and how to do one."""

    name: str
    title: str
    about: str  # for a reader of the page: what is tried and what counts
    columns: Mapping[str, str]  # counted, with headings
    forbidden: frozenset[str]  # columns that have to stay zero
    chunks: Callable[[], Sequence[Chunk]]
    run: Callable[[Chunk, Journal], Result]


def find_part(name: str) -> Part:
    """A part by its name, or by the module that it is in."""
    part: Part = import_module(PARTS.get(name, name)).PART
    return part


def stamp(chunk: Chunk) -> str:
    """A hash of the files that a chunk's result depends on, as they were when it was first asked for."""
    return hashlib.sha256(b"".join(map(_digest, sorted(chunk.sources)))).hexdigest()[:16]


@lru_cache
def _digest(place: str) -> bytes:
    """A hash of a file, or of the code and data below a folder; a part names what it needs of `HERE` by itself."""
    path, digest = ROOT / place, hashlib.sha256(place.encode())
    files = [path] if path.is_file() else sorted(file for file in path.rglob("*") if file.suffix in READ)
    own = [file for file in files if place.startswith(HERE) or not file.is_relative_to(ROOT / HERE)]
    for file in own:
        digest.update(file.relative_to(ROOT).as_posix().encode() + file.read_bytes())
    return digest.digest()
