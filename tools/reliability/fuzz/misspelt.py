"""Valid command lines with exactly one word misspelt: a command, an argument, an option's name or its value."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from tools.reliability.chunk import Chunk
from tools.reliability.fuzz.commands import NO_OPTIONS, PATIENCE_S, SAID, invoke, leaves, prepare, the_command
from tools.reliability.fuzz.judging import Tally, limited
from tools.reliability.fuzz.values import Generator

ARGUMENTS = {"problem": "hvac", "role": "attacker", "result": "here.json", "runs": "runs", "parts": "fuzz"}
NAMES = {"list": "hvac", "report": "hvac", "train": "hvac-attack"}
NAME = "hvac-attack"  # every other argument
REQUIRED = {"best-response": ("--defender", "mtd2")}
WRITTEN = ("--out", "--to", "--html", "--csv", "--plot", "--meetings", "--markdown", "--id")  # any word will do
VALUES = {
    "--algo": "shared-ppo",
    "--attacker": "constant",
    "--back-end": "loky",
    "--backend": "loky",
    "--baseline": "constant",
    "--certified": "here.json",
    "--config": "here.json",
    "--controller": "clip",
    "--defender": "mtd2",
    "--device": "cpu",
    "--folder": "runs",
    "--form": "local",
    "--interpretation": "default",
    "--knob": "learning_rate=0.001",
    "--league": "here.json",
    "--metric": "return",
    "--oracle": "shared-ppo",
    "--paper": "runs",
    "--part": "robots",
    "--per": "return",
    "--preset": "learning",
    "--preset-set": "paper",
    "--problem": "hvac",
    "--reading": "default",
    "--render": "film.gif",
    "--role": "attacker",
    "--runs": "runs",
    "--set": "duration_h=1",
    "--start": "here.json",
    "--suite": "paper",
    "--table": "impact",
    "--task": "x4>4",
    "--tracker": "none",
    "--variant": "plain",
}
NUMBER = "1o"  # where a number belongs


def misspelt(chunk: Chunk, tally: Tally) -> None:
    """Each word of each command, once, in an empty folder."""
    prepare()
    rng = np.random.default_rng([chunk.number, 9])
    for words in lines(rng):
        tally.attempt(" ".join(words), limited(lambda words=words: invoke(words), PATIENCE_S))  # type: ignore[misc]


def lines(rng: Generator) -> Iterator[list[str]]:
    """Every command line that is to be tried."""
    for name, command in leaves((), the_command(), left_out=()):
        given = [_argument(name, each) for each in command.params if each.param_type_name == "argument"]
        alone = [word for each in command.params for word in SAID.get(each.opts[0], ())]
        line = [*name, *given, *REQUIRED.get(name[0], ()), *alone]
        for place in range(len(name) + len(given)):
            yield [*line[:place], _spoilt(line[place], rng), *line[place + 1 :]]
        for each in command.params:
            option = each.opts[0]
            if each.param_type_name == "argument" or option in NO_OPTIONS:
                continue
            flag = getattr(each, "is_flag", False)
            value = VALUES.get(option, "")
            yield [*line, f"--{_spoilt(option[2:], rng)}", *([] if flag else [value or "1"])]
            if not flag and option not in WRITTEN:
                yield [*line, option, _spoilt(value, rng) if value else NUMBER]


def _argument(name: tuple[str, ...], parameter: Any) -> str:
    return NAMES.get(name[0]) or ARGUMENTS.get(parameter.name, NAME)


def _spoilt(word: str, rng: Generator) -> str:
    """The word with one letter dropped, doubled, or swapped with the next one that differs."""
    letters = [place for place, letter in enumerate(word) if letter.isalpha()]
    place = letters[rng.integers(len(letters))]
    kind = rng.integers(3)
    if kind == 0:
        return word[:place] + word[place + 1 :]
    if kind == 1 or place + 1 == len(word) or word[place] == word[place + 1]:
        return word[:place] + word[place] + word[place:]
    return word[:place] + word[place + 1] + word[place] + word[place + 2 :]
