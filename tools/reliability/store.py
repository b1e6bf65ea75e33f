"""Finished chunks on disk, so that a run goes on where the last one stopped."""

from __future__ import annotations

import json
import subprocess
from datetime import date
from pathlib import Path
from typing import Any

from cps_agents.files import write_json
from tools.reliability.chunk import ROOT, Chunk, Result, stamp

UNKNOWN = "unknown"  # commit, outside a repository
CHANGED = "+"  # behind a commit that was changed since


class Store:
    """Results of chunks, one file each, valid at their commit as long as nothing that they depend on changes."""

    def __init__(self, folder: Path, *, fresh: bool = False) -> None:
        self.folder = folder
        if fresh and folder.is_dir():
            for file in folder.glob("*/*.json"):
                file.unlink()
        self.commit = commit()

    def get(self, chunk: Chunk) -> Result | None:
        """The result of a chunk that was done before with the same commit and sources, if its file is undamaged."""
        try:
            kept: Any = json.loads(self._path(chunk).read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None
        if not isinstance(kept, dict) or not isinstance(kept.get("counts"), dict):
            return None
        return kept if (kept.get("commit"), kept.get("sources")) == (self.commit, stamp(chunk)) else None

    def put(self, chunk: Chunk, result: Result) -> Result:
        """Keep a result, with the commit and the date that it is from."""
        described = {
            "row": chunk.row,
            "sources": stamp(chunk),
            "commit": self.commit,
            "date": date.today().isoformat(),
        }
        kept = {**result, **described}
        write_json(self._path(chunk), kept)
        return kept

    def _path(self, chunk: Chunk) -> Path:
        return self.folder / chunk.part / f"{chunk.name}.json"


def commit() -> str:
    """The commit of the source tree, with a plus sign if it was changed since; "unknown" outside a repository."""
    try:
        head = _git("rev-parse", "--short=10", "HEAD")
        return head + (CHANGED if _git("status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.CalledProcessError):
        return UNKNOWN


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
