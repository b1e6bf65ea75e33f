"""Progress of long work on stderr: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING

from cps_agents.console import err

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

LINE_EVERY_S = 5.0
SILENCE_S = 8.0  # after which a line says that the work goes on


class Progress:
    """Counts up to `total`; use it as a context manager."""

    def __init__(self, title: str, total: int) -> None:
        self.title, self.total = title, total
        self._console = err()
        self._bar: Bar | None = None
        self._shown = self._state = (0, "")  # what the last line, or the start, said; and what there is to say
        self._started = self._last_line = time.monotonic()
        self._over = threading.Event()

    def __enter__(self) -> Progress:
        if self._console.is_terminal:
            self._bar = _make_bar(self._console)
            self._bar.add_task(self.title, total=self.total, note="")
            self._bar.start()
        else:
            threading.Thread(target=self._break_silence, daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._over.set()
        if self._bar is not None:
            self._bar.stop()

    def update(self, done: int, note: str = "") -> None:
        """Show that `done` of the total is finished."""
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], total=self.total, completed=done, note=note)
            return
        self._state = (done, note)
        if self._state == self._shown:
            return
        finished = done >= self.total and done != self._shown[0]
        if finished or time.monotonic() - self._last_line >= LINE_EVERY_S:
            self._print_line()

    def _print_line(self) -> None:
        self._last_line, self._shown = now, (done, note) = time.monotonic(), self._state
        self._console.print(f"{self.title}: {done}/{self.total} after {now - self._started:.0f} s  {note}".rstrip())

    def _break_silence(self) -> None:
        """Say every now and then where a long step stands that reports nothing itself."""
        while not self._over.wait(min(SILENCE_S, 1.0)):
            if time.monotonic() - self._last_line >= SILENCE_S:
                self._print_line()

    def report(self, done: int, total: int, note: str = "") -> None:
        """Show that `done` of `total` is finished, where the total is not known in advance."""
        self.total = total
        self.update(done, note)

    def say(self, line: str) -> None:
        """Print a line that stays, above the bar where there is one."""
        console = self._console if self._bar is None else self._bar.console
        console.print(line, soft_wrap=True)


def _make_bar(console: object) -> Bar:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar
    from rich.table import Column

    assert isinstance(console, Console)
    rest = Column(ratio=1, no_wrap=True, overflow="ellipsis")  # a long note is cut, not the count or the time
    return Bar(
        TextColumn("{task.description}"),
        BarColumn(bar_width=16),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}", style="dim", markup=False, table_column=rest),
        console=console,
        expand=True,
    )
