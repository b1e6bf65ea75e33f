"""Where the curves of a training run go: TensorBoard's files, or nowhere."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

from cps_agents.errors import CommandError
from cps_envs.core.errors import near, require


class RunTracker(Protocol):
    """Takes numbers by name in the course of a run."""

    def log(self, values: Mapping[str, float], steps: int) -> None:
        """What the numbers are after so many decisions."""

    def close(self) -> None:
        """Everything has been said."""


def make_tracker(kind: str, folder: Path) -> RunTracker:
    """A tracker by its name, of the run in a folder.

    Raises:
        CommandError: there is none of that name.
        MissingExtraError: its package is not installed.
    """
    check_tracker(kind)
    return TRACKERS[kind](folder)


def check_tracker(kind: str) -> None:
    """Whether there is a tracker of that name.

    Raises:
        CommandError: there is none.
    """
    if kind not in TRACKERS:
        raise CommandError(f"there is no tracker {kind!r}. {near(kind, TRACKERS)}")


class Silent:
    """A tracker that keeps nothing (`--tracker none`)."""

    def __init__(self, folder: Path) -> None:
        pass

    def log(self, values: Mapping[str, float], steps: int) -> None:
        """Nothing."""

    def close(self) -> None:
        """Nothing."""


class TensorBoard:
    """Event files in the run's folder `tensorboard/`, for `tensorboard --logdir runs`."""

    def __init__(self, folder: Path) -> None:
        require("tensorboard", extra="train", purpose="TensorBoard's files")
        from tensorboard.summary import Writer

        self._folder = folder / "tensorboard"
        self._hook = threading.excepthook
        threading.excepthook = self._overhear
        with self._named():
            self._writer: Any = Writer(str(self._folder))

    def log(self, values: Mapping[str, float], steps: int) -> None:
        """One scalar for each name."""
        with self._named():
            for name, value in values.items():
                self._writer.add_scalar(name, value, steps)
            self._writer.flush()

    def close(self) -> None:
        """Close the file."""
        try:
            with self._named():
                self._writer.close()
        finally:
            threading.excepthook = self._hook

    def _overhear(self, caught: Any) -> None:
        """Leave out what ends TensorBoard's thread, such as a full disk: the writer's next call raises it again."""
        if type(caught.thread).__module__ != "tensorboard.summary.writer.event_file_writer":
            self._hook(caught)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """While errors name the folder."""
        try:
            yield
        except OSError as error:
            raise OSError(error.errno, f"it cannot be written: {error.strerror}", str(self._folder)) from error


TRACKERS: Mapping[str, Callable[[Path], RunTracker]] = {"tensorboard": TensorBoard, "none": Silent}
