"""Measuring one item after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from cps_agents.errors import explain
from cps_agents.interruption import exit_code
from tools.bench.interfaces import measure_yardsticks
from tools.bench.row import Measurement, Row, Yardsticks

Report = Callable[[int, int, str], None]  # items done, items in all, what comes next


@dataclass
class Findings:
    """What has been measured so far."""

    rows: list[Row] = field(default_factory=list)
    yardsticks: list[Yardsticks] = field(default_factory=list)  # one for each part, in the order of measuring
    interrupted: int = 0  # the exit code that a signal asks for; 0 if everything was measured


def measure(items: Sequence[Measurement], seconds: float, report: Report) -> Findings:
    """Everything, with about `seconds` of CPU for each item; Ctrl-C ends it with what is there."""
    found = Findings()
    try:
        for done, item in enumerate(items):
            report(done, len(items), f"{item.part}: {item.name}")
            if done == 0 or item.part != items[done - 1].part:
                found.yardsticks.append(measure_yardsticks(seconds))
            found.rows.append(_measured(item, seconds, found.yardsticks[-1]))
        report(len(items), len(items), "")
    except KeyboardInterrupt as error:
        found.interrupted = exit_code(error)
    return found


def _measured(item: Measurement, seconds: float, yardsticks: Yardsticks) -> Row:
    """An item that cannot be measured, such as a policy that needs options, says why."""
    try:
        return Row(item.part, item.name, item.measure(seconds, yardsticks), item.note)
    except Exception as error:
        why = explain(error)
        if why is None:
            raise
        return Row(item.part, item.name, {}, why)
