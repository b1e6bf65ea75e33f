"""A shell that gives a command too little, or says what cannot be meant: one sentence, and exit code 2."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cps_agents.errors import explain
from cps_agents.surroundings import wrong_variables

COMMAND = (sys.executable, "-c", "from cps_agents.command import main; main()", "list", "fdi")
on_unix = pytest.mark.skipif(sys.platform == "win32", reason="there are no such limits")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        (
            "NUMBA_NUM_THREADS",
            "x",
            "the environment variable NUMBA_NUM_THREADS = 'x' must be a whole number",
        ),
        (
            "NUMBA_NUM_THREADS",
            "0",
            "the environment variable NUMBA_NUM_THREADS = '0' must be a whole number",
        ),
        ("NUMBA_DISABLE_JIT", "yes", "the environment variable NUMBA_DISABLE_JIT = 'yes' must be a whole number"),
        (
            "SOURCE_DATE_EPOCH",
            "x",
            "the environment variable SOURCE_DATE_EPOCH = 'x' must be a whole number, at least 0",
        ),
        ("CPS_ENVS_QUIET", "banana", "the environment variable CPS_ENVS_QUIET = 'banana' must be 1 or 0"),
        ("CPS_ENVS_TRUTS", "1", "there is no environment variable CPS_ENVS_TRUTS: did you mean CPS_ENVS_TRUST?"),
        ("CPS_ENVS_MEETING", "m", "there is no environment variable CPS_ENVS_MEETING: did you mean CPS_ENVS_MEETINGS?"),
    ],
)
def test_what_a_variable_cannot_mean_is_said(name: str, value: str, said: str) -> None:
    (sentence,) = wrong_variables({name: value, "PATH": "x", "NUMBA_CACHE_DIR": "y"})
    assert sentence.startswith(said)


def test_variables_that_are_right_are_not_spoken_of() -> None:
    right = {"NUMBA_NUM_THREADS": "2", "SOURCE_DATE_EPOCH": "0", "CPS_ENVS_TRUST": "1", "CPS_ENVS_QUIET": "", "A": "x"}
    assert list(wrong_variables({**right, "NUMBA_DISABLE_JIT": "", "CPS_ENVS_MEETINGS": "here"})) == []


def test_a_command_ends_with_the_sentence() -> None:
    ended = subprocess.run(
        COMMAND, env={**os.environ, "SOURCE_DATE_EPOCH": "x"}, capture_output=True, text=True, check=False
    )
    said = "Error: the environment variable SOURCE_DATE_EPOCH = 'x' must be a whole number, at least 0\n"
    assert (ended.returncode, ended.stdout, ended.stderr) == (2, "", said)


@on_unix
@pytest.mark.parametrize("limit", [200_000, 500_000])
def test_too_little_memory_is_one_sentence(limit: int) -> None:
    ended = subprocess.run(
        ["sh", "-c", f'ulimit -v {limit}; exec "$@"', "sh", *COMMAND], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 2
    assert ended.stderr == (
        f"Error: this shell allows {limit * 1.024 / 1000:.0f} MB of memory, and a command needs 600 MB at least: raise "
        "the limit, for example by `ulimit -v unlimited`\n"
    )


@on_unix
@pytest.mark.parametrize("count", [8, 32])
def test_few_open_files_are_enough_or_one_sentence(count: int, tmp_path: Path) -> None:
    ended = subprocess.run(
        ["sh", "-c", f'ulimit -n {count}; exec "$@"', "sh", *COMMAND], capture_output=True, text=True, check=False
    )
    assert "Traceback" not in ended.stderr
    if count == 32:
        assert ended.returncode == 0
    elif ended.returncode:
        assert "raise the limit of open files" in ended.stderr
        assert ended.returncode == 2


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EFBIG])
def test_a_full_disk_is_told_with_what_to_do(number: int) -> None:
    said = explain(OSError(number, os.strerror(number), "out.json"))
    assert said is not None
    assert "'out.json': make room there, or name another folder" in said


@on_unix
def test_a_file_that_may_not_grow_is_told_of(tmp_path: Path) -> None:
    command = ("sh", "-c", 'ulimit -f 0; exec "$@"', "sh", *COMMAND[:-2], "play", "fdi", "--preset", "paper")
    ended = subprocess.run(
        [*command, "--record", str(tmp_path / "episode.csv")], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 2
    assert "make room there, or name another folder" in ended.stderr
    assert "Traceback" not in ended.stderr
