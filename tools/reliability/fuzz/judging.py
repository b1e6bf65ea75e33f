"""Telling a clear refusal from an accident, and counting both."""

from __future__ import annotations

import signal
import traceback
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import gymnasium
import numpy as np
import pettingzoo

from cps_agents.errors import CommandError
from cps_envs.core.errors import ConfigurationError, MissingExtraError, UnknownNameError
from cps_envs.core.types import Array
from tools.reliability.chunk import CODE, HERE, ROOT, Chunk, Result
from tools.reliability.journal import Journal

OURS = (ConfigurationError, UnknownNameError, MissingExtraError, CommandError, gymnasium.error.Error)
MAY_BE_RAISED = (ValueError, TypeError, OSError)  # on purpose, by a `raise` of ours or of the interfaces' packages
PLACES = tuple(str(ROOT / name) for name in (*CODE, HERE)) + tuple(
    str(Path(module.__file__ or "").parent) for module in (gymnasium, pettingzoo)
)
ENOUGH_S = 2.0  # CPU seconds that a trial may take, if it is one that may go on for long
SHOWN = 300  # characters of a counterexample


class EnoughError(BaseException):
    """A trial was accepted and has worked for long enough."""


class Tally:
    """Counts what becomes of the trials of a chunk, and keeps one counterexample of each kind."""

    def __init__(self, chunk: Chunk, journal: Journal) -> None:
        self._chunk, self._journal = chunk, journal
        self._number = 0
        self.counts = dict.fromkeys(("inputs", "accepted", "refused", "accidental", "nonsense"), 0)
        self.examples: dict[str, str] = {}

    def attempt(self, what: str, act: Callable[[], str | None]) -> None:
        """Try something whose return value names what is wrong with its outcome."""
        number, self._number = self._number, self._number + 1
        if not self._journal.begin(number, what):
            return
        try:
            wrong = act()
        except (KeyboardInterrupt, GeneratorExit):
            raise
        except EnoughError:
            self._count("accepted", number, what, None)
        except BaseException as error:
            self._count("refused" if is_refusal(error) else "accidental", number, what, error)
        else:
            self._count("nonsense" if wrong else "accepted", number, what, wrong)

    def result(self) -> Result:
        """For the chunk."""
        return {"counts": self.counts, "examples": self.examples}

    def _count(self, kind: str, number: int, what: str, outcome: object) -> None:
        self.counts["inputs"] += 1
        self.counts[kind] += 1
        if kind in ("accidental", "nonsense"):
            place = place_of(outcome) if isinstance(outcome, BaseException) else str(outcome)[:SHOWN]
            where = f"{self._chunk.row} {self._chunk.number}, trial {number}"
            self.examples.setdefault(f"{kind}, {place}", f"{where}: {what[:SHOWN]}: {repr(outcome)[:SHOWN]}")


def is_refusal(error: BaseException) -> bool:
    """Whether an error is one of our own, or was raised on purpose with a message, not by accident further inside."""
    if not str(error).strip():
        return False
    if isinstance(error, OURS):
        return True
    if not isinstance(error, MAY_BE_RAISED):
        return False
    if isinstance(error, OSError) and error.filename is not None:
        return True  # the system's own words name the file
    steps = traceback.extract_tb(error.__traceback__)
    return bool(steps) and steps[-1].filename.startswith(PLACES) and (steps[-1].line or "").startswith("raise")


def place_of(error: BaseException) -> str:
    """Where an error comes from: the last place in our own code."""
    steps = [step for step in traceback.extract_tb(error.__traceback__) if step.filename.startswith(str(ROOT))]
    return f"{Path(steps[-1].filename).relative_to(ROOT)}:{steps[-1].lineno}" if steps else "?"


def stop_after(seconds: float, fired: list[bool]) -> None:
    """Raise EnoughError in this process after so many CPU seconds, and note it in `fired`; 0 calls it off.

    It is raised again after as many more: a library may have swallowed it.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        fired.append(True)
        raise EnoughError

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds, seconds)


def limited(act: Callable[[], str | None], seconds: float = ENOUGH_S) -> Callable[[], str | None]:
    """The same trial, stopped after so many CPU seconds."""

    def run() -> str | None:
        fired: list[bool] = []
        stop_after(seconds, fired)
        try:
            return act()
        except Exception as error:
            if fired:  # a library, such as the compiler, has turned it into an error of its own
                raise EnoughError from error
            raise
        finally:
            stop_after(0, fired)

    return run


def wrong_numbers(observation: Array, rewards: object) -> str | None:
    """What is wrong with an observation and with rewards, if anything is."""
    if observation.dtype != np.float32:
        return f"the observation has type {observation.dtype}"
    if not (np.abs(observation) <= 1).all():  # also finds NaN
        return "the observation is outside its space"
    return None if np.isfinite(np.asarray(rewards, np.float64)).all() else "the reward is not finite"
