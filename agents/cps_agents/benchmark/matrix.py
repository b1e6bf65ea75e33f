"""Results as what the tables show: attackers in rows, defenders or settings in columns, the paper's number beside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cps_agents.benchmark.suite import Outcome
from cps_baselines.arena import Contestant
from cps_baselines.paper.tables import verdict
from cps_baselines.schedule import PaperCell, Setting


@dataclass(frozen=True)
class Entry:
    """A meeting: what came out, in numbers and as text."""

    setting: str
    attacker: str
    defender: str
    episodes: int
    metric: str  # the one that is shown
    value: float  # its mean
    deviation: float
    means: dict[str, float]  # of every metric
    text: str
    paper: PaperCell | None
    crash: bool | None  # ours; None where the benchmark does not say what a crash is
    cpu_s: float

    @property
    def difference(self) -> float | None:
        """Ours minus the paper's."""
        return None if self.paper is None else self.value - self.paper.value

    @property
    def verdict(self) -> str:
        """Agreement with the paper, empty where it prints nothing."""
        return "" if self.difference is None else verdict(self.difference)

    @property
    def crash_agrees(self) -> bool | None:
        """Whether there is a crash where the paper has one, and none where not."""
        return None if self.paper is None or self.crash is None else self.crash == self.paper.crash

    @property
    def paper_lines(self) -> list[str]:
        """The paper's number, its crash flag where ours is another, our difference and what to think of it."""
        if self.paper is None or self.difference is None:
            return []
        flag = ["with crash" if self.paper.crash else "no crash"] if self.crash_agrees is False else []
        return [f"paper {self.paper.value:.2f}", *flag, f"{self.difference:+.2f} {self.verdict}"]


@dataclass(frozen=True)
class Grid:
    """What a table or a picture shows: a setting with its defenders, or several settings side by side."""

    name: str  # for file names
    title: str
    axis: str  # what distinguishes the columns
    legend: str
    columns: list[str]
    rows: list[tuple[str, list[Entry]]]  # an attacker's heading and its meetings
    notes: list[str]


def grids(outcome: Outcome) -> list[Grid]:
    """The tables of a benchmark, in the order of the settings."""
    shared: dict[str, list[Setting]] = {}
    for setting in outcome.benchmark.settings:
        name = setting.table.name if setting.table else setting.name
        shared.setdefault(name, []).append(setting)
    return [_grid(outcome, name, settings) for name, settings in shared.items()]


def _grid(outcome: Outcome, name: str, settings: list[Setting]) -> Grid:
    first, table = settings[0], settings[0].table
    parts = [list(entries(outcome, setting)) for setting in settings]
    rows = [
        (attacker.heading, [entry for part in parts for entry in part[place]])
        for place, attacker in enumerate(first.attackers)
    ]
    return Grid(
        name=name,
        title=table.title if table else first.title,
        axis=table.axis if table else "defender",
        legend=first.legend,
        columns=[_column(setting, defender) for setting in settings for defender in setting.defenders],
        rows=rows,
        notes=[note for setting in settings for note in notes(outcome, setting)],
    )


def _column(setting: Setting, defender: Contestant) -> str:
    if setting.table is None:
        return defender.name
    return setting.title if len(setting.defenders) == 1 else f"{setting.title} {defender.name}"


def every_entry(outcome: Outcome) -> list[Entry]:
    """The meetings of all settings."""
    return [entry for setting in outcome.benchmark.settings for row in entries(outcome, setting) for entry in row]


def entries(outcome: Outcome, setting: Setting) -> Iterator[list[Entry]]:
    """The rows of a setting."""
    for attacker in setting.attackers:
        yield [_entry(outcome, setting, attacker, defender) for defender in setting.defenders]


def _entry(outcome: Outcome, setting: Setting, attacker: Contestant, defender: Contestant) -> Entry:
    meeting = (setting.name, attacker.name, defender.name)
    result = outcome.result(meeting)
    means = {name: float(np.mean(values)) for name, values in result["metrics"].items()}
    metric = attacker.metric or setting.metric
    share = means[metric] / ((means[setting.reference] if setting.reference else 0.0) or np.nan)
    shown = result["metrics"][metric]
    spread = dict(zip(("lower", "median", "upper"), np.quantile(shown, (0.25, 0.5, 0.75)).tolist(), strict=True))
    printed = [cell for cell in outcome.benchmark.paper if (cell.setting, cell.attacker, cell.defender) == meeting]
    crashes = outcome.benchmark.crash_metric
    return Entry(
        *meeting,
        episodes=len(shown),
        metric=metric,
        value=means[metric],
        deviation=float(np.std(shown)),
        means=means,
        text=setting.form.format(value=means[metric], share=share, **spread, **means),
        paper=printed[0] if printed else None,
        crash=means[crashes] > 0 if crashes else None,
        cpu_s=result["cpu_s"],
    )


def notes(outcome: Outcome, setting: Setting) -> list[str]:
    """What the contestants of a setting found out in advance, as lines for the reader."""
    return [f"{name}: {found['note']}" for name, found in outcome.preparations(setting.name).items()]
