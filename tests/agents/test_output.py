"""Output to a pipe or a file whose encoding is not Unicode: every table is printed, with plain characters."""

from __future__ import annotations

import json
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
    "league": (
        *("league", "disbanding", *QUICK, "--attacker", "lead", "--defender", "none"),
        *("--episodes", "2", "--jobs", "1"),
    ),
}
ONE_AFTER_THE_OTHER = """
import json, sys
from cps_agents.command import main

for name, arguments in json.loads(sys.argv[1]).items():
    sys.argv = ["cps-envs", *arguments]
    print(f"<{name}>")
    try:
        main()
    except SystemExit as end:
        assert not end.code, (name, end.code)
"""


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_tables_are_printed_where_the_encoding_has_no_lines(encoding: str, tmp_path: Path) -> None:
    result = subprocess.run(
        [sys.executable, "-c", ONE_AFTER_THE_OTHER, json.dumps(COMMANDS)],
        env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
        cwd=tmp_path,
        capture_output=True,
    )
    printed = result.stdout.decode(encoding)
    assert result.returncode == 0, result.stderr.decode(encoding)
    for name in COMMANDS:
        _, found, rest = printed.partition(f"<{name}>")
        assert found
        assert "----" in rest.partition("\n<")[0], name
    assert "??" not in printed


def test_notes_are_printed_whole(capsys: pytest.CaptureFixture[str]) -> None:
    line = f"Written: runs[mine]/{'long' * 50}/page.html"
    note(line)
    assert capsys.readouterr().err == f"{line}\n"


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_command_outlives_the_reader_of_its_output(unbuffered: str) -> None:
    program = "import cps_agents.command as c; c._outlive_readers(); print('x' * 10**6, flush=True); print('y')"
    env = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=env
    ) as run:
        assert run.stdout is not None
        assert run.stderr is not None
        assert run.stdout.read(1) == b"x"
        run.stdout.close()
        assert (run.stderr.read(), run.wait()) == (b"", 0)
