"""Output to a pipe or a file whose encoding is not Unicode: every table is printed, with plain characters."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cps_agents.console import note

QUICK = ("--set", "duration_s=20")
COMMANDS = {
    "list": ("list",),
    "zoo": ("zoo", "list"),
    "play": ("play", "disbanding", "--attacker", "lead", *QUICK),
    "league": ("league", "disbanding", *QUICK, "--attacker", "lead", "--defender", "none", "--episodes", "2"),
}


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
@pytest.mark.parametrize("command", COMMANDS)
def test_tables_are_printed_where_the_encoding_has_no_lines(command: str, encoding: str, tmp_path: Path) -> None:
    code = "import sys; from cps_agents.command import main; sys.argv[0] = 'cps-envs'; main()"
    extra = ("--jobs", "1") if command == "league" else ()
    result = subprocess.run(
        [sys.executable, "-c", code, *COMMANDS[command], *extra],
        env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
        cwd=tmp_path,
        capture_output=True,
    )
    printed = result.stdout.decode(encoding)
    assert result.returncode == 0, result.stderr.decode(encoding)
    assert "----" in printed
    assert "??" not in printed


def test_notes_are_printed_whole(capsys: pytest.CaptureFixture[str]) -> None:
    line = f"Written: runs[mine]/{'long' * 50}/page.html"
    note(line)
    assert capsys.readouterr().err == f"{line}\n"
