"""Signals: finished work is kept, the exit code tells which signal, and a sentence tells how to go on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from cps_agents import locking
from cps_baselines.interruption import Ended, ending, exit_code
from tests.agents.command_line import invoke
from tests.agents.test_locking import COMMANDS, LEARNING

WHOLE = "from cps_agents.cli import main; main()"
AGAIN = "Finished work is kept: the same command continues."
RESUMED = "Finished work is kept: the same command with --resume continues."
TRAIN = ("train", "RogueAttack-v0", "--name", "tiny", "--knob", "evaluation_episodes=2")
LEAGUE = ("league", "rogue", "--attackers", "square", "--attackers", "random", "--attackers", "strike")
LONG = (*LEAGUE, "--defenders", "pd", "--defenders", "monitor", "--episodes", "500")
needs_signals = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@contextmanager
def started(*arguments: str, ignoring: bool = False) -> Iterator[subprocess.Popen[str]]:
    """The command as a process of its own; `ignoring` Ctrl-C as a shell's background job does."""
    program = f"import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); {WHOLE}" if ignoring else WHOLE
    command = [sys.executable, "-c", program, *arguments]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def wait_for(there: Any, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 300
    while time.monotonic() < deadline and process.poll() is None and not there():
        time.sleep(0.1)


def wait_until_gone(group: int) -> bool:
    """Whether all processes of a group end soon."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


def stopped(process: subprocess.Popen[str], code: int, advice: str) -> None:
    """That the process ends as it should, and all that it started with it."""
    printed = process.communicate(timeout=120)[1]
    assert process.returncode == code, printed
    assert f"Interrupted. {advice}" in " ".join(printed.split())
    assert "Traceback" not in printed
    assert wait_until_gone(process.pid)


@needs_signals
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_league_that_is_terminated_keeps_its_pairs(tmp_path: Path, meetings: Path, jobs: str) -> None:
    pytest.importorskip("scipy")
    with started(*LONG, "--jobs", jobs, "--out", str(tmp_path), ignoring=True) as process:
        wait_for(lambda: list(meetings.glob("*.json")), process)
        process.send_signal(signal.SIGINT)  # ignored
        second = invoke(*LONG, "--out", str(tmp_path))
        assert second.exit_code == 2, second.output
        assert "another command is writing" in second.stderr
        os.killpg(process.pid, signal.SIGTERM) if jobs == "2" else process.terminate()
        stopped(process, 143, AGAIN)
    assert list(meetings.glob("*.json"))
    assert not (tmp_path / "rogue.json").exists()
    assert not list(tmp_path.rglob(".drafts"))


@needs_signals
@pytest.mark.slow
@pytest.mark.parametrize("command", ["train", "best-response", "self-play"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_no_run_says_that_it_is_running_after_a_signal(tmp_path: Path, command: str, number: signal.Signals) -> None:
    pytest.importorskip("sb3_contrib")
    seeds = ("--seeds", "3", "--jobs", "2", "--steps", "10000000", "--out", str(tmp_path))
    arguments = TRAIN if command == "train" else (*COMMANDS[command][:-4], "--episodes", "2")

    def records() -> list[dict[str, Any]]:
        folders = [Path(folder) for folder, _, names in os.walk(tmp_path) if "run.json" in names]
        return [json.loads((folder / "run.json").read_text()) for folder in folders]

    with started(*arguments, *seeds) as process:
        wait_for(lambda: len([each for each in records() if each.get("steps")]) > 1, process)
        os.killpg(process.pid, number)
        stopped(process, 128 + number, RESUMED)
    assert [each["status"] for each in records()] == ["interrupted"] * 2
    assert len(list(tmp_path.rglob("policy.json"))) == 2


@needs_signals
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", [*COMMANDS, "train", "oracle", "list"])
def test_every_command_tells_how_to_go_on(
    name: str, number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name in (*LEARNING, "train"):
        pytest.importorskip("sb3_contrib")

    def interrupted(*arguments: Any) -> None:
        signal.raise_signal(number)

    others = {"train": (*TRAIN, "--seeds", "1"), "oracle": ("oracle", "--task", "x4>4"), "list": ("list",)}
    commands: dict[str, tuple[str, ...]] = {**COMMANDS, **others}
    monkeypatch.setattr(locking.FileLock, "acquire", interrupted)
    monkeypatch.setattr("cps_agents.catalogue.describe_everything", interrupted)
    out = () if name == "list" else ("--out", str(tmp_path / "out.json"))
    result = invoke(*commands[name], *out)
    assert result.exit_code == 128 + number, result.output
    advice = RESUMED if name in (*LEARNING, "train") else "" if name == "list" else AGAIN
    assert result.stderr.split("\n")[-2] == f"Interrupted. {advice}".strip()


def test_signals_are_handled_as_before_afterwards() -> None:
    before = signal.getsignal(signal.SIGTERM)

    def keep() -> None:
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            signal.raise_signal(signal.SIGTERM)  # does not disturb what is being kept

    with pytest.raises(Ended) as ended, ending():
        keep()
    assert exit_code(ended.value) == 143
    assert exit_code(KeyboardInterrupt()) == 130
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with ending():
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
