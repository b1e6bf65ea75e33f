"""One command at a time writes a folder; the lock of a process that died is free."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cps_agents.errors import CommandError
from cps_agents.locking import alone_at, alone_in
from tests.agents.command_line import invoke

HOLD = """
import time
from pathlib import Path
from cps_agents.locking import {0}
with {0}(Path({1!r})):
    print("held", flush=True)
    time.sleep(600)
"""
SMALL = ("--episodes", "2", "--jobs", "1")
COMMANDS = {
    "league": ("league", "rogue", "--attackers", "square", "--defenders", "pd", *SMALL),
    "benchmark": ("benchmark", "rogue", "--quick"),
    "examination": ("benchmark", "rogue", "--suite", "learned", "--quick"),
    "contest": ("contest", "rogue", "--quick"),
    "reproduce": ("reproduce", "all", "--quick", "--reading", "ch5"),
    "self-play": ("self-play", "rogue", "--attackers", "none", "--defenders", "pd", "--oracle", "ppo", *SMALL),
    "best-response": ("best-response", "rogue", "attacker", "--against", "pd", "--oracle", "ppo", *SMALL),
}
LEARNING = ("self-play", "best-response")


@contextmanager
def held(function: str, path: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that writes there."""
    other = subprocess.Popen(
        [sys.executable, "-c", HOLD.format(function, str(path))], stdout=subprocess.PIPE, text=True
    )
    try:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        yield other
    finally:
        other.kill()
        other.wait()
        other.stdout.close()  # type: ignore[union-attr]


def refused(*arguments: str) -> str:
    result = invoke(*arguments)
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.stderr
    return " ".join(result.stderr.split())


def test_two_processes_do_not_write_one_folder(tmp_path: Path) -> None:
    pytest.importorskip("scipy")
    home = tmp_path / "kept"
    with held("alone_in", home) as other:
        for name, command in COMMANDS.items():
            if name in LEARNING:
                pytest.importorskip("sb3_contrib")
            message = refused(*command, "--out", str(home))
            assert f"another command is writing into {home}: wait until it has ended" in message, name
        assert sorted(path.name for path in home.iterdir()) == [".lock"]
        other.kill()
        other.wait()
        with alone_in(home):  # a dead process holds nothing
            pass


@pytest.mark.parametrize(
    "command",
    [
        ("oracle", "--task", "x4>4"),
        ("oracle", "--preset", "drawn", "--episodes", "1"),
        ("double-oracle", "--ratio", "1"),
    ],
)
def test_two_processes_do_not_write_one_file(command: tuple[str, ...], tmp_path: Path) -> None:
    pytest.importorskip("cma")
    path = tmp_path / "found.json"
    with held("alone_at", path):
        assert f"another command is writing {path}" in refused(*command, "--out", str(path))
        assert not path.exists()


def test_two_processes_do_not_train_one_run(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    run = tmp_path / "tiny" / "seed-0"
    arguments = ("train", "RogueAttack-v0", "--name", "tiny", "--seeds", "1", "--jobs", "1", "--steps", "8")
    with held("alone_in", run):
        assert f"another command is writing into {run}" in refused(*arguments, "--out", str(tmp_path))
        assert not (run / "run.json").exists()


def test_a_lock_is_free_after_an_error_and_may_be_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "found.json"
    with alone_at(path), pytest.raises(CommandError, match="another command"), alone_at(path, wait_s=0.1):
        raise AssertionError("both write")
    with pytest.raises(RuntimeError, match="inside"), alone_at(path):
        raise RuntimeError("inside")
    with alone_at(path):
        pass
