"""Output to a pipe or a file whose encoding is not Unicode: every table is printed, with plain characters."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest

from cps_agents.cli import show_warning
from cps_agents.console import err, note, out
from cps_agents.sheet import Sheet
from tests.turns import in_turn

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


@pytest.mark.parametrize("encoding", in_turn(["ascii", "cp1252"], 2))
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


@pytest.mark.parametrize("steering", ["\x1b[2J", "\x1b]0;title\x07", "\x9b2J", "\u202e", "\r"])
def test_no_text_steers_the_terminal(steering: str, capsys: pytest.CaptureFixture[str]) -> None:
    for console in (out(), err()):
        console.print(f"[bold]a{steering}b[/]", soft_wrap=True)
        console.print(Sheet(f"t{steering}", (f"h{steering}",), [(f"c{steering}",)]))
    note(f"n{steering}")
    show_warning(UserWarning(f"w{steering}"), UserWarning, f"file{steering}.py", 1)
    for text in capsys.readouterr():
        assert "".join(letter for letter in steering if letter.isprintable()) in text
        assert not any(unicodedata.category(letter) == "Cc" for letter in text.replace("\n", ""))
        assert "\u202e" not in text


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
