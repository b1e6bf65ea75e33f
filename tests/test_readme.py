"""Every snippet of the README runs as printed."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
COMMANDS = [line[2:] for block in re.findall(r"```console\n(.*?)```", README, re.DOTALL) for line in block.splitlines()]
COMMANDS = [command for command in COMMANDS if command.startswith("cps-envs ")]


@pytest.mark.parametrize("snippet", PYTHON, ids=lambda text: text.strip().splitlines()[-1][:40])
def test_python_snippets_run(snippet: str, tmp_path: Path) -> None:
    if "stable_baselines3" in snippet:
        pytest.importorskip("stable_baselines3")
    run([sys.executable, "-c", snippet], tmp_path)


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_run(command: Any, tmp_path: Path) -> None:
    run([sys.executable, "-c", "from cps_agents.cli import main; main()", *shlex.split(command)[1:]], tmp_path)


def test_there_are_snippets_of_both_kinds() -> None:
    assert len(PYTHON) >= 4
    assert len(COMMANDS) >= 4


def run(command: Any, folder: Any) -> None:
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stdout[-2000:] + result.stderr[-4000:]
