"""Tiny commands that write, and running them in a fork, so that what they import is imported once."""

from __future__ import annotations

import importlib
import os
import resource
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

MODULES = (
    "cps_agents.cli",
    "cps_agents.league.league",
    "cps_agents.league.report",
    "cps_paper.benchmark.report",
    "scipy.optimize",
    "scipy.stats",
    "matplotlib.pyplot",
)
LEARNING = ("cps_agents.learning.shared", "cps_agents.learning.learner", "cps_agents.league.self_play")
SHORT = "--set duration_s=4"
TINY = (
    "--jobs 1 --resume --knob num_envs=4 --knob n_steps=32 --knob batch_size=64 "
    "--knob n_epochs=1 --knob evaluations=2 --knob evaluation_episodes=2"
)


@dataclass(frozen=True)
class Job:
    """A command that writes into a folder, and below it into one of finished meetings."""

    name: str
    words: str
    learns: bool = False  # then what comes out depends on where it was interrupted, and only its files are compared
    out: str = "--out {}"  # how the folder is named, which Minari knows from its variable
    once: bool = False  # it refuses to write again what is there


JOBS = (
    Job(
        "league",
        f"league rogue --attacker none --attacker square --defender none --defender pd --episodes 2 --jobs 1 {SHORT}",
    ),
    Job(
        "benchmark",
        "reproduce benchmark rogue --quick --table paper-1 --attacker square --defender pd --defender sliding --jobs 1",
    ),
    Job("train", f"train rogue-attack --seeds 1 --steps 512 {SHORT} {TINY}", learns=True),
    Job(
        "self-play",
        "self-play rogue --iterations 1 --attacker square --defender pd --steps 256 --episodes 2 "
        f"--set duration_s=20 {TINY}",  # in less time nobody is suspected, and a defender has nothing to learn
        learns=True,
    ),
    Job("report", f"report rogue --attacker square --defender pd --episodes 2 --jobs 1 {SHORT}"),
    Job("certify", "certify --preset paper --task v1>1 --jobs 1", out="--out {}/optima.json"),
    Job(
        "dataset",
        f"dataset rogue --role attacker --attacker square --defender pd --episodes 2 {SHORT}",
        out="",
        once=True,
    ),
    Job("score", "score policy rogue-attack square --dev", out="--out {}/score.json"),
)


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int  # negative: by that signal
    words: str  # what it wrote to stderr


def warm_up(job: Job) -> None:
    """Import what the command needs."""
    for name in (*MODULES, *(LEARNING if job.learns else ())):
        importlib.import_module(name)


@dataclass(frozen=True)
class Started:
    """A process, and the pipe that its stderr goes to; a file would be limited as its other files are."""

    process: int
    words: int


def start(job: Job, folder: Path, before: Callable[[], None] = lambda: None) -> Started:
    """Start the command in a fork, which calls `before` first."""
    reading, writing = os.pipe()
    child = os.fork()
    if child:
        os.close(writing)
        return Started(child, reading)
    code = 99
    try:
        os.dup2(writing, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        before()
        code = _command(job, folder)
    finally:
        os._exit(code)


def _command(job: Job, folder: Path) -> int:
    from cps_agents.cli import main

    os.environ |= {"CPS_ENVS_MEETINGS": str(folder / "meetings"), "MINARI_DATASETS_PATH": str(folder)}
    sys.argv = ["cps-envs", *job.words.split(), *(word.format(folder) for word in job.out.split())]
    try:
        main()
    except SystemExit as ended:
        return ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:
        import traceback

        traceback.print_exc()
        return 1
    return 0


def wait(started: Started) -> Ended:
    """How a started command ended."""
    with os.fdopen(started.words, encoding="utf-8", errors="replace") as words:
        said = words.read()
    _, status, _ = os.wait4(started.process, 0)
    return Ended(os.waitstatus_to_exitcode(status), said)


def run(job: Job, folder: Path, before: Callable[[], None] = lambda: None) -> Ended:
    """Start the command and wait for its end."""
    return wait(start(job, folder, before))


def with_small_disk(size: int) -> Callable[[], None]:
    """Let no file of this process grow beyond so many bytes, as on a full disk."""

    def limit() -> None:
        import signal

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # an OSError instead
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit
