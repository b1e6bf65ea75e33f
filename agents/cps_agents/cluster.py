"""The machines of a Ray cluster as a place to work: `--cluster auto` or `--cluster ray://HOST:PORT`."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from platform import node
from typing import Any, Protocol, TextIO

from cps_agents.arena.store import fingerprint
from cps_agents.errors import CommandError
from cps_agents.files import draft_name
from cps_agents.machine import versions
from cps_envs.core.declare.foreign import ForeignSettingWarning
from cps_envs.core.errors import require
from cps_envs.core.policies.trust import VARIABLE

ADDRESS = re.compile(r"auto|ray://[^/\s:]+:\d+")
ATTEMPTS = 10  # at a piece of work whose worker or machine dies
EVERYTHING = ""  # instead of a problem: the sources of all


class Cluster(Protocol):
    """Where work is done by other machines."""

    def executor(self) -> Executor:
        """What hands pieces of work to them and brings the results back."""


@dataclass(frozen=True)
class RayCluster:
    """A Ray cluster that this process has joined; it counts its machines and cores itself."""

    address: str

    def executor(self) -> Executor:
        """One piece of work for each core of the cluster at a time."""
        return _RayExecutor(Asked.here())

    def __str__(self) -> str:
        ray = _ray()
        machines = sum(each["Alive"] for each in ray.nodes())
        return f"Cluster {self.address}: {machines} machine(s), {ray.cluster_resources().get('CPU', 0):.0f} cores."


def join(address: str) -> RayCluster:
    """Join a running cluster.

    Raises:
        CommandError: it is no address, or no cluster answers there.
        MissingExtraError: Ray is not installed.
    """
    if not ADDRESS.fullmatch(address):
        raise CommandError(
            f"--cluster {address!r} is no address: write `auto` on a machine of the cluster, or `ray://HOST:10001`"
        )
    ray = _ray()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            handled = signal.getsignal(signal.SIGTERM)  # Ray puts its own in the place
            ray.init(address=address, log_to_driver=False, logging_level="ERROR", ignore_reinit_error=True)
            if threading.current_thread() is threading.main_thread():
                signal.signal(signal.SIGTERM, handled)
    except Exception as error:
        reason = str(error).strip().partition("\n")[0] or type(error).__name__
        raise CommandError(
            f"no Ray cluster answers at --cluster {address} ({reason.rstrip('.')}): start one with `ray start --head`"
        ) from error
    sys.stdout = Results(sys.stdout)
    return RayCluster(address)


class Results:
    """Standard output of the thread that prints results. Ray's threads tell there which workers died: to stderr."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._thread = stream, threading.get_ident()

    def write(self, text: str) -> int:
        """Write a text where it belongs."""
        return (self._stream if threading.get_ident() == self._thread else sys.stderr).write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _ray() -> Any:
    return require("ray", extra="ray", purpose="--cluster")


@dataclass(frozen=True)
class Asked:
    """With what, and where, a piece of work was asked for; plain data that goes with it to another machine."""

    folder: str  # relative paths begin here, where a machine has it
    trusted: str  # consent to run code of one's own, see `cps_envs.trust`
    versions: Mapping[str, str]
    sources: str  # hash of our code

    @classmethod
    def here(cls) -> Asked:
        """As this process would do it."""
        return cls(os.getcwd(), os.environ.get(VARIABLE, ""), versions(), fingerprint(EVERYTHING))

    def settle(self) -> None:
        """Have this process do it as the one that asked would.

        Raises:
            CommandError: it has other versions or other code, so its numbers could differ.
        """
        mine, theirs = Asked.here(), self.versions
        if mine.versions != theirs:
            other = ", ".join(
                f"{name} {mine.versions.get(name)} instead of {wanted}"
                for name, wanted in theirs.items()
                if mine.versions.get(name) != wanted
            )
            raise CommandError(f"machine {node()} of the cluster has {other}: install the same versions everywhere")
        if mine.sources != self.sources:
            raise CommandError(f"machine {node()} of the cluster has other code of cps-envs: install the same there")
        os.environ[VARIABLE] = self.trusted
        warnings.simplefilter("ignore", ForeignSettingWarning)  # the process that asked tells
        with suppress(OSError):  # work that reads no file does not need it
            os.chdir(self.folder)


def do(asked: Asked, function: Callable[..., Any], *arguments: Any) -> Any:
    """Do a piece of work on whatever machine this is."""
    asked.settle()
    return function(*arguments)


class _RayExecutor(Executor):
    """Hands work to Ray, which tries again where a worker or a machine has died."""

    def __init__(self, asked: Asked) -> None:
        ray = _ray()
        self._do = ray.remote(num_cpus=1, max_retries=ATTEMPTS)(do)
        self._asked = ray.put(asked)
        self._running: dict[Future[Any], Any] = {}

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Ask for a piece of work."""
        reference = self._do.remote(self._asked, partial(function, **kwargs) if kwargs else function, *args)
        future: Future[Any] = Future()
        self._running[future] = reference
        reference.future().add_done_callback(partial(self._hand_over, future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Interrupt what still runs, which keeps what it has."""
        for reference in list(self._running.values()):
            _ray().cancel(reference)
        self._running.clear()

    def _hand_over(self, future: Future[Any], found: Future[Any]) -> None:
        self._running.pop(future, None)
        error = found.exception()
        if error is None:
            future.set_result(found.result())
        else:
            future.set_exception(_own(error))


def _own(error: BaseException) -> BaseException:
    """The error that the work raised, without Ray's traceback around it."""
    cause = getattr(error, "cause", None)
    if cause is None:
        return CommandError(f"the cluster has given up a piece of work: {str(error).strip().partition(chr(10))[0]}")
    if isinstance(cause, ModuleNotFoundError):
        return CommandError(f"{cause} on a machine of the cluster: install there what is installed here")
    return cause if isinstance(cause, Exception) else error


@contextmanager
def marked(folder: Path) -> Iterator[Path]:
    """While a file lies in a folder by which other machines tell that they see the same one, see `check_seen`."""
    mark = folder.absolute() / f".{draft_name()}"
    folder.mkdir(parents=True, exist_ok=True)
    mark.touch()
    try:
        yield mark
    finally:
        mark.unlink(missing_ok=True)


def check_seen(mark: Path) -> None:
    """Whether this machine sees the folder of whoever asked.

    Raises:
        CommandError: it does not.
    """
    if not mark.exists():
        raise CommandError(
            f"machine {node()} of the cluster does not see {mark.parent}: with --out, name a folder that all "
            "machines share"
        )
