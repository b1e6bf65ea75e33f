"""Code of somebody else at play: in a process of its own, which is handed observations and returns actions.

That process holds no match, no opponent and no seed. The matches against all opponents of a panel go on together, and
their rows arrive in an order of chance, so that no row tells whom it meets. Each batch of episodes has its own process.
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from threading import Condition, Thread, Timer
from typing import IO, Any

import numpy as np

from cps_agents.errors import CommandError
from cps_agents.scoring.playing import BATCH, Report, Seeds, batch
from cps_agents.scoring.tracks import Track
from cps_envs.core.errors import PolicyError
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, State

ANSWER_S = 600  # that the process may take for a start or an answer
LONGEST = 2000  # characters of a line that it writes
KINDS = ("b1", "i8", "f8")  # of its actions
NOT_DUMPABLE = (4, 0)  # of Linux's prctl: no other process may read the memory of this one
SERVER = "cps_agents.scoring.server"
KEPT = ("PATH", "HOME", "LANG", "SYSTEMROOT", "NUMBA_CACHE_DIR")  # of the environment, which may hold secrets


class Process:
    """A process that runs the code."""

    def __init__(self, track: Track, source: str) -> None:
        """Start it, and wait until the code has made its policy.

        Raises:
            PolicyError: it cannot.
        """
        if os.name != "posix":
            raise CommandError("code of somebody else plays on Linux and macOS only: verify it there")
        with suppress(OSError, AttributeError):  # of other systems
            ctypes.CDLL(None).prctl(*NOT_DUMPABLE)
        self._folder = tempfile.TemporaryDirectory()
        kept = {name: value for name, value in os.environ.items() if name in KEPT}
        threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-m", SERVER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=self._folder.name,
            env={**kept, **threads, "CPS_ENVS_QUIET": "1"},
            start_new_session=True,
        )
        try:
            self._tell({"problem": track.problem, "role": track.role}, source.encode())
            self._answer()
        except BaseException:
            self.close()
            raise

    def ask(self, rows: IntArray, parts: dict[str, Array]) -> Array:
        """Actions (n, ...) for the episodes `rows` (n,) of the batch; `parts` are what they show.

        Raises:
            PolicyError: it fails, is silent for too long, or answers something else.
        """
        parts = {"rows": rows, **{name: np.ascontiguousarray(each) for name, each in parts.items()}}
        layout = {name: [each.dtype.str, list(each.shape)] for name, each in parts.items()}
        self._tell({"parts": layout}, b"".join(each.tobytes() for each in parts.values()))
        answer, out = self._answer(), self._pipe(self._process.stdout)
        kind, shape = answer.get("kind"), answer.get("shape", ())
        well = kind in KINDS and isinstance(shape, list) and all(type(each) is int and each > 0 for each in shape)
        if not well or len(shape) > 3 or shape[0] != len(rows) or np.prod(shape) > 10**7:
            raise PolicyError(f"policy.py answered actions of the shape {str(shape)[:40]} for {len(rows)} episodes")
        size = int(np.prod(shape)) * np.dtype(kind).itemsize
        with self._in_time():
            data = out.read(size)
        if len(data) != size:
            raise PolicyError("policy.py ended in the middle of an answer")
        return np.frombuffer(data, kind).reshape(shape)

    def close(self) -> None:
        """End it and all that it has started."""
        with suppress(OSError):
            os.killpg(self._process.pid, 9)
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                self._pipe(pipe).close()
        self._folder.cleanup()

    @staticmethod
    def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
        assert pipe is not None
        return pipe

    def _tell(self, head: dict[str, Any], data: bytes) -> None:
        into = self._pipe(self._process.stdin)
        with suppress(BrokenPipeError):  # its last answer says why
            into.write(json.dumps({**head, "bytes": len(data)}).encode() + b"\n" + data)
            into.flush()

    def _answer(self) -> dict[str, Any]:
        with self._in_time():
            line = self._pipe(self._process.stdout).readline(LONGEST)
        try:
            answer = json.loads(line)  # of the other process
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            raise PolicyError(f"policy.py gave no answer: its process has ended, or was silent for {ANSWER_S} s")
        if "error" in answer:
            raise PolicyError(f"policy.py failed: {str(answer['error'])[:LONGEST]}")
        return answer

    @contextmanager
    def _in_time(self) -> Iterator[None]:
        timer = Timer(ANSWER_S, self._process.kill)
        timer.start()
        try:
            yield
        finally:
            timer.cancel()


@dataclass
class Question:
    """What the episodes `rows` of a match show."""

    rows: IntArray
    parts: dict[str, Array]


class Together:
    """Matches that ask one process together, each in a thread of its own, with their episodes in an order of chance."""

    def __init__(
        self, ask: Callable[[IntArray, dict[str, Array]], Array], counts: Sequence[int], order: IntArray
    ) -> None:
        """`counts` are the episodes of each match, and `order` a permutation of all of them."""
        self._ask, self._firsts, self._order = ask, np.cumsum([0, *counts]), order
        self._present, self._turn = set(range(len(counts))), Condition()
        self._asked: dict[int, Question] = {}
        self._answers: dict[int, Array] = {}
        self.failed: Exception | None = None

    def ask(self, place: int, question: Question) -> Array:
        """The actions for a question of a match; waits until all matches that go on have asked.

        Raises:
            PolicyError: the process failed at the question of any of them.
        """
        with self._turn:
            self._asked[place] = question
            self._settle()
            self._turn.wait_for(lambda: place in self._answers or self.failed is not None)
            if self.failed is not None:
                raise PolicyError(str(self.failed))
            return self._answers.pop(place)

    def leave(self, place: int) -> None:
        """The match has ended."""
        with self._turn:
            self._present.discard(place)
            self._settle()

    def _settle(self) -> None:
        """Ask if nobody is missing."""
        if not self._asked or self._asked.keys() != self._present:
            return
        places = sorted(self._asked)
        rows = np.concatenate([self._order[self._firsts[place] + self._asked[place].rows] for place in places])
        sizes = [len(self._asked[place].rows) for place in places]
        by_row = np.argsort(rows)
        names = self._asked[places[0]].parts
        parts = {name: np.concatenate([self._asked[place].parts[name] for place in places])[by_row] for name in names}
        try:
            actions = self._ask(rows[by_row], parts)
            back = np.empty_like(actions)
            back[by_row] = actions
            self._answers |= dict(zip(places, np.split(back, np.cumsum(sizes)[:-1]), strict=True))
        except Exception as error:
            self.failed = error
        self._asked.clear()
        self._turn.notify_all()


class Seat:
    """What a match takes for a policy: it hands on what is observed, and nothing else."""

    def __init__(self, together: Together, place: int) -> None:
        self._together, self._place = together, place

    def predict(
        self,
        observation: Observation,
        state: State | None = None,
        episode_start: BoolArray | None = None,
        deterministic: bool = False,
        action_masks: BoolArray | None = None,
    ) -> tuple[Array, State | None]:
        """See `Policy.predict`; the state says which episodes of the match these are."""
        rows = np.arange(len(observation)) if state is None else state[0]
        parts = {"observation": observation, "start": np.asarray(episode_start, np.bool_)}
        if action_masks is not None:
            parts["masks"] = action_masks
        return self._together.ask(self._place, Question(rows, parts)), (rows,)


def played_apart(track: Track, source: str, seeds: Seeds, order: int, report: Report) -> list[FloatArray]:
    """What the attacker is paid where code plays the role of a track; `order` draws the order of the episodes.

    Raises:
        PolicyError: the code fails, gives impossible actions, or takes too long.
    """
    parts, done, generator = [], 0, np.random.default_rng(order)
    for first in range(0, len(seeds[0]), BATCH):
        own = [each[first : first + BATCH] for each in seeds]
        parts.append(_batch(track, source, own, generator.permutation(sum(map(len, own)))))
        report(done := done + sum(map(len, own)))
    return [np.concatenate(rows) for rows in zip(*parts, strict=True)]


def _batch(track: Track, source: str, seeds: Seeds, order: IntArray) -> list[FloatArray]:
    process = Process(track, source)
    together = Together(process.ask, list(map(len, seeds)), order)
    found: list[FloatArray | None] = [None] * len(seeds)
    errors: list[Exception] = []

    def play(place: int) -> None:
        seat: Any = Seat(together, place)
        try:
            found[place] = batch(track, seat, track.panel[place].reference, seeds[place])
        except Exception as error:
            errors.append(error)
            together.failed = error
        finally:
            together.leave(place)

    threads = [Thread(target=play, args=(place,), daemon=True) for place in range(len(seeds))]
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        process.close()
    if errors:
        raise errors[0]
    return [each for each in found if each is not None]
