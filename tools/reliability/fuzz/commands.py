"""Command lines put together from the real options and odd values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import cache
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import cps_agents.cli
import cps_agents.errors
from tools.reliability.chunk import Chunk
from tools.reliability.fuzz.judging import Tally, limited
from tools.reliability.fuzz.values import Generator, pick

INPUTS = 150  # of a chunk
PATIENCE_S = 1.5  # CPU seconds for a command that was accepted
LIBRARIES = ("cma", "cvxpy", "matplotlib.pyplot", "numba", "pymoo.core.algorithm", "stable_baselines3")
LEFT_OUT = ("warm",)  # nothing in them but time
SAID = {"--jobs": ("--jobs", "1"), "--dry-run": ("--dry-run",)}  # always; without them work goes on in other processes
NO_OPTIONS = ("--help", "--publish", "--trust", "--debug", *SAID)  # nothing to be tried here
WORDS = (
    *("", " ", "none", "nan", "-1", "0", "1", "1e400", "1_000", "0x10", "²", "%s", "\x00", "[", "a" * 3000, "../x"),
    *("rogue", "hvac", "fdi", "disbanding", "paper", "learning", "easy", "attacker", "defender", "ppo", "cpu"),
    *("HvacAttack-v0", "rogue-attack", "zoo:hvac-attack", "square", "pd", "mtd2", "all", "os:system", "sb3:x"),
    *("duration_s=4", "duration_s=", "=1", "duration_s=nan", "unknown=1", "tau_s=[1,2]", "tau_s={}", "x=[[[["),
    *("missing/folder", "missing.json", "/proc/nothing", "here.json", "broken.json", "2", "3", "true", "--", "-x"),
)


def commands(chunk: Chunk, tally: Tally) -> None:
    """Each command with options and values drawn from real and odd ones, in an empty folder."""
    prepare()
    rng = np.random.default_rng([chunk.number, 8])
    found = list(leaves((), the_command()))
    for _ in range(INPUTS):
        name, command = pick(found, rng)
        words = [*name, *_options(command, rng)]
        shown = " ".join(map(ascii, words))[:400]
        tally.attempt(shown, limited(lambda words=words: invoke(words), PATIENCE_S))  # type: ignore[misc]


def prepare() -> None:
    """Import libraries and write the files that command lines name to the working folder."""
    for library in LIBRARIES:  # now: an import that is stopped half-way leaves a library that does not work
        with suppress(ImportError):
            import_module(library)
    Path("here.json").write_text("{}", encoding="utf-8")
    Path("broken.json").write_text("{", encoding="utf-8")


def invoke(words: Sequence[str]) -> str | None:
    """Run a command line; what is wrong with its exit code, if anything is. An error that it ends with is raised."""
    explained: list[Exception] = []
    explain = cps_agents.errors.explain

    def remember(error: Exception) -> str | None:
        explained.append(error)
        return explain(error)

    with patch.object(cps_agents.cli, "explain", remember), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        try:
            code = the_command().main(list(words), prog_name="cps-envs", standalone_mode=False)
        except Exception as error:
            if getattr(error, "exit_code", None) == 2:  # the command-line library's own
                raise ValueError(error.format_message() or "nothing was said") from error  # type: ignore[attr-defined]
            raise
    if explained:
        raise explained[-1]
    return f"exit code {code}" if code else None


@cache
def the_command() -> Any:
    """`cps-envs` itself, which takes a tenth of a second to put together."""
    return cps_agents.cli.whole()


def leaves(name: tuple[str, ...], command: Any) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every command that is no group, with the words that call it."""
    inside = getattr(command, "commands", None)
    if inside is None:
        yield name, command
        return
    for word, each in inside.items():
        if word not in LEFT_OUT:
            yield from leaves((*name, word), each)


def _options(command: Any, rng: Generator) -> list[str]:
    words: list[str] = []
    for parameter in command.params:
        option = parameter.opts[0]
        words += SAID.get(option, ())
        if option in NO_OPTIONS or rng.random() < 0.6:
            continue
        values = [] if getattr(parameter, "is_flag", False) else [pick(WORDS, rng)]
        words += values if parameter.param_type_name == "argument" else [option, *values]
    if rng.random() < 0.1:
        words.append(pick(WORDS, rng))
    return words
