"""Signals and locks: finished work is kept, a sentence tells how to go on, one command at a time writes a folder."""

from __future__ import annotations

import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from cps_agents.errors import CommandError
from cps_agents.files import alone_at, alone_in
from cps_agents.interruption import Ended, ending, exit_code
from cps_agents.scoring.board import FOLDER
from cps_agents.scoring.results import read_score
from tests.agents.command_line import invoke, refusal
from tests.processes import is_gone, wait_until
from tests.turns import in_turn

WHOLE = "from cps_agents.cli import main; main()"
AGAIN = "Finished work is kept: the same command continues."
RESUMED = "Finished work is kept: the same command with --resume continues."
TRAIN = ("train", "RogueAttack-v0", "--name", "tiny", "--knob", "evaluation_episodes=2")
LEAGUE = ("league", "rogue", "--attacker", "square", "--attacker", "random", "--attacker", "strike")
LONG = (*LEAGUE, "--defender", "pd", "--defender", "monitor", "--episodes", "200")
needs_signals = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
HOLD = """
import time
from pathlib import Path
from cps_agents.files import {0}
with {0}(Path({1!r})):
    print("held", flush=True)
    time.sleep(600)
"""
SMALL = ("--episodes", "2", "--jobs", "1")
COMMANDS = {
    "league": ("league", "rogue", "--attacker", "square", "--defender", "pd", *SMALL),
    "benchmark": ("reproduce", "benchmark", "rogue", "--quick"),
    "reproduce": ("reproduce", "all", "--quick", "--reading", "ch5"),
    "self-play": ("self-play", "rogue", "--attacker", "none", "--defender", "pd", *SMALL),
    "best-response": ("best-response", "rogue", "attacker", "--defender", "pd", *SMALL),
}
LEARNING = ("self-play", "best-response")


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
    wait_until(lambda: process.poll() is not None or there(), 300.0)


def stopped(process: subprocess.Popen[str], code: int, advice: str) -> None:
    """That the process ends as it should, and all that it started with it."""
    printed = process.communicate(timeout=120)[1]
    assert process.returncode == code, printed
    assert f"Interrupted. {advice}" in " ".join(printed.split())
    assert "Traceback" not in printed
    assert wait_until(lambda: is_gone(process.pid))


@needs_signals
@pytest.mark.parametrize("jobs", in_turn(["2", "1"], 2))
def test_a_league_that_is_terminated_keeps_its_pairs(tmp_path: Path, meetings: Path, jobs: str) -> None:
    pytest.importorskip("scipy")
    with started(*LONG, "--jobs", jobs, "--out", str(tmp_path), ignoring=True) as process:
        wait_for(lambda: list(meetings.glob("*.json")), process)
        process.send_signal(signal.SIGINT)  # ignored
        assert "another command is writing" in refusal(*LONG, "--out", str(tmp_path))
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
    pytest.importorskip("torch")
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
@pytest.mark.parametrize("name", [*COMMANDS, "train", "certify", "list"])
def test_every_command_tells_how_to_go_on(
    name: str, number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name in (*LEARNING, "train"):
        pytest.importorskip("torch")

    def interrupted(*arguments: Any) -> None:
        signal.raise_signal(number)

    others = {
        "train": (*TRAIN, "--seeds", "1"),
        "certify": ("certify", "--preset", "paper", "--task", "x4>4"),
        "list": ("list", "hvac"),
    }
    commands: dict[str, tuple[str, ...]] = {**COMMANDS, **others}
    monkeypatch.setattr("filelock.FileLock.acquire", interrupted)
    monkeypatch.setattr("cps_agents.commands.list.describe_problem", interrupted)
    out = () if name == "list" else ("--out", str(tmp_path / "out.json"))
    result = invoke(*commands[name], *out)
    assert result.exit_code == 128 + number, result.output
    advice = RESUMED if name in (*LEARNING, "train") else "" if name == "list" else AGAIN
    assert result.stderr.split("\n")[-2] == f"Interrupted. {advice}".strip()
    assert result.stdout == ""


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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_a_kernel_is_compiled_ends_the_process_after_it(number: signal.Signals) -> None:
    llvm = pytest.importorskip("llvmlite.binding")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    module = llvm.parse_assembly(f'target triple = "{llvm.get_process_triple()}"')
    engine = llvm.create_mcjit_compiler(module, llvm.Target.from_default_triple().create_target_machine())
    kept = []

    def keep(module: Any, compiled: bytes) -> None:  # called from C, where an exception would be lost
        signal.raise_signal(number)
        kept.append(compiled)

    def compile_and_wait() -> None:
        engine.finalize_object()
        for _ in range(500):  # one long sleep would not be interrupted by a signal that another thread raises
            time.sleep(0.02)

    engine.set_object_cache(keep, lambda module: None)
    with pytest.raises(Ended) as ended, ending():
        compile_and_wait()
    assert exit_code(ended.value) == 128 + number
    assert kept


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with ending():
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)


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


def test_two_processes_do_not_write_one_folder(tmp_path: Path) -> None:
    pytest.importorskip("scipy")
    home = tmp_path / "kept"
    with held("alone_in", home) as other:
        for name, command in COMMANDS.items():
            if name in LEARNING:
                pytest.importorskip("torch")
            message = refusal(*command, "--out", str(home))
            assert f"another command is writing into {home}: wait until it has ended" in message, name
        assert sorted(path.name for path in home.iterdir()) == [".lock"]
        other.kill()
        other.wait()
        with alone_in(home):  # a dead process holds nothing
            pass


@pytest.mark.parametrize(
    "command",
    [
        ("certify", "--preset", "paper", "--task", "x4>4"),
        ("certify", "--preset", "drawn", "--episodes", "1"),
    ],
)
def test_two_processes_do_not_write_one_file(command: tuple[str, ...], tmp_path: Path) -> None:
    pytest.importorskip("cma")
    path = tmp_path / "found.json"
    with held("alone_at", path):
        assert f"another command is writing {path}" in refusal(*command, "--out", str(path))
        assert not path.exists()


def test_two_processes_do_not_train_one_run(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    run = tmp_path / "tiny" / "seed-0"
    arguments = ("train", "RogueAttack-v0", "--name", "tiny", "--seeds", "1", "--jobs", "1", "--steps", "8")
    with held("alone_in", run):
        assert f"another command is writing into {run}" in refusal(*arguments, "--out", str(tmp_path))
        assert not (run / "run.json").exists()


def test_a_lock_is_free_after_an_error_and_may_be_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "found.json"
    with alone_at(path), pytest.raises(CommandError, match="another command"), alone_at(path, wait_s=0.1):
        raise AssertionError("both write")
    with pytest.raises(RuntimeError, match="inside"), alone_at(path):
        raise RuntimeError("inside")
    with alone_at(path):
        pass


class Full(io.StringIO):
    """A stream to a disk that has no room."""

    def write(self, text: str) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")


def verifying(monkeypatch: pytest.MonkeyPatch, at_the_second: Callable[[], None]) -> tuple[Any, str]:
    """What `score verify` of two entries leads to where something happens at the second; the line of the first."""
    entry = FOLDER / "rogue-attack" / "square"
    checked: list[Path] = []

    def play(path: Path, report: Any, say: Callable[[str], None]) -> Any:
        if checked:
            at_the_second()
        checked.append(path)
        say("5120 episodes played")
        return read_score(path)

    monkeypatch.setattr("cps_agents.commands.score.play", play)
    return invoke("score", "verify", str(entry), str(entry)), f"{entry}: {read_score(entry).line}; hand-set"


@needs_signals
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_a_verification_with_what_was_verified(
    number: int, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    result, first = verifying(monkeypatch, lambda: signal.raise_signal(number))
    assert (result.exit_code, result.stdout.splitlines()) == (code, [first])
    assert "Interrupted." in result.stderr


@pytest.mark.parametrize("stream", ["out", "err"])
def test_a_full_disk_never_passes_for_a_verification(stream: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fill() -> None:
        for module in ("cli", "console") if stream == "err" else ("commands.score",):
            monkeypatch.setattr(f"cps_agents.{module}.{stream}", lambda: Console(file=Full()))

    result, first = verifying(monkeypatch, fill)
    assert (result.exit_code, result.stdout.splitlines()) == (2, [first])
    assert ("No space left on device" in result.stderr) == (stream == "out")
