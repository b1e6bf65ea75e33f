"""What git keeps is small, and what `make test-quick` runs is there."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MOST_BYTES = 1_500_000
LARGER: frozenset[str] = frozenset()  # pictures that may be larger, by their path from the root


def test_no_tracked_file_is_large() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("needs the repository of git, not only its files")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    files = [ROOT / name for name in listed.split("\0") if name and name not in LARGER]
    large = {file.relative_to(ROOT).as_posix(): size for file in files if (size := _size(file)) > MOST_BYTES}
    assert not large, "keep it elsewhere, or name the picture in LARGER"


def test_git_ignores_what_the_first_pages_write() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("needs the repository of git, not only its files")
    text = "".join((ROOT / page).read_text(encoding="utf-8") for page in ("README.md", "docs/start.md"))
    written = set(re.findall(r"(?:--render |--record |\.save\(\"|--out )([\w.-]+)", text))
    written |= {"report/index.html", "league/rogue.json", "self-play/x.json", "results/meetings"}  # by default
    kept = [name for name in sorted(written) if not _ignored(name)]
    assert not kept
    assert {"rogue.gif", "fdi-attack.zip"} <= written


def _ignored(name: str) -> bool:
    asked = name if Path(name).suffix else f"{name}/file"
    return subprocess.run(["git", "check-ignore", "-q", asked], cwd=ROOT, check=False).returncode == 0


@pytest.mark.skipif(shutil.which("make") is None, reason="needs GNU make")
def test_what_is_run_for_a_change_exists() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    choices = re.search(r"^CHOICES := (.*)", makefile, re.MULTILINE)
    assert choices
    for part in choices[1].split():
        words = ["make", "--dry-run", "--silent", "test-quick", f"FOR={part}"]
        shown = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        line = next(line for line in reversed(shown.splitlines()) if " -m pytest -q " in line)
        files = [word for word in line.split() if word.startswith("tests/")]
        assert files
        assert not [file for file in files if not (ROOT / file).is_file()], f"test-quick FOR={part}"


def _size(file: Path) -> int:
    return file.stat().st_size if file.is_file() else 0  # a deletion that is not committed yet
