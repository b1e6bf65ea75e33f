"""Virtual environments of the peers: what is installed there, and what would be the newest."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
from collections.abc import Sequence
from pathlib import Path

NOTES_AT_MOST = 300  # characters of an error
CONFLICT = "The conflict is caused by:"  # pip's words before it names the requirements


def python_of(folder: Path) -> Path:
    """The interpreter of a virtual environment."""
    return folder / ("Scripts" if os.name == "nt" else "bin") / "python"


def install(folder: Path, wheel: Path, packages: Sequence[str], extras: str = "") -> str:
    """Install our wheel and packages of others; what pip complains about, or ""."""
    python = python_of(folder)
    if not python.exists():
        venv.create(folder, with_pip=True)
    pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input"]
    try:
        subprocess.run([*pip, f"{wheel}{extras}", *packages], check=True, capture_output=True, text=True)
        subprocess.run([*pip, "--no-deps", "--force-reinstall", str(wheel)], check=True, capture_output=True, text=True)
    except subprocess.CalledProcessError as error:
        return str(error.stderr)[-NOTES_AT_MOST:]
    return ""


def versions(python: Path, names: Sequence[str]) -> dict[str, str]:
    """The installed versions of packages."""
    code = (
        "import json, sys; from importlib.metadata import version; "
        "print(json.dumps({name: version(name) for name in sys.argv[1:]}))"
    )
    done = subprocess.run([str(python), "-c", code, *names], check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout))


def newest(name: str) -> str:
    """The newest release of a package that the index offers for our Python, or "" if the index does not answer."""
    command = [sys.executable, "-m", "pip", "index", "versions", "--disable-pip-version-check", name]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    first = done.stdout.strip().partition("\n")[0]  # such as "skrl (2.1.1)"
    return first.partition("(")[2].partition(")")[0]


def conflict(folder: Path, wheel: Path, name: str, version: str) -> str:
    """Which requirements keep pip from installing this release beside our wheel."""
    command = [str(python_of(folder)), "-m", "pip", "install", "--dry-run", "--no-input", f"{name}=={version}"]
    done = subprocess.run([*command, str(wheel)], capture_output=True, text=True, check=False)
    lines = done.stdout.partition(CONFLICT)[2].strip().partition("\n\n")[0]
    return "; ".join(line.strip() for line in lines.splitlines())
