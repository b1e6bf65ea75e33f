"""A benchmark as tables on the terminal and as files: JSON, CSV, Markdown, heat maps.

They show attackers in rows, defenders or settings in columns, the paper's number beside.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cps_agents.heatmap import draw_matrix
from cps_agents.table import Cell, Table, csv_text, styled
from cps_baselines.arena import Contestant
from cps_envs import find_problem
from cps_paper.benchmark.schedule import PaperCell, Setting
from cps_paper.benchmark.suite import BenchmarkOutcome
from cps_paper.printed.tables import verdict


@dataclass(frozen=True)
class BenchmarkEntry:
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
    rows: list[tuple[str, list[BenchmarkEntry]]]  # an attacker's heading and its meetings
    notes: list[str]


def grids(outcome: BenchmarkOutcome) -> list[Grid]:
    """The tables of a benchmark, in the order of the settings."""
    shared: dict[str, list[Setting]] = {}
    for setting in outcome.benchmark.settings:
        name = setting.table.name if setting.table else setting.name
        shared.setdefault(name, []).append(setting)
    return [_grid(outcome, name, settings) for name, settings in shared.items()]


def _grid(outcome: BenchmarkOutcome, name: str, settings: list[Setting]) -> Grid:
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


def every_entry(outcome: BenchmarkOutcome) -> list[BenchmarkEntry]:
    """The meetings of all settings."""
    return [entry for setting in outcome.benchmark.settings for row in entries(outcome, setting) for entry in row]


def entries(outcome: BenchmarkOutcome, setting: Setting) -> Iterator[list[BenchmarkEntry]]:
    """The rows of a setting."""
    for attacker in setting.attackers:
        yield [_entry(outcome, setting, attacker, defender) for defender in setting.defenders]


def _entry(outcome: BenchmarkOutcome, setting: Setting, attacker: Contestant, defender: Contestant) -> BenchmarkEntry:
    meeting = (setting.name, attacker.name, defender.name)
    result = outcome.result(meeting)
    means = {name: float(np.mean(values)) for name, values in result["metrics"].items()}
    metric = attacker.metric or setting.metric
    share = means[metric] / ((means[setting.reference] if setting.reference else 0.0) or np.nan)
    shown = result["metrics"][metric]
    spread = dict(zip(("lower", "median", "upper"), np.quantile(shown, (0.25, 0.5, 0.75)).tolist(), strict=True))
    printed = [cell for cell in outcome.benchmark.paper if (cell.setting, cell.attacker, cell.defender) == meeting]
    crashes = outcome.benchmark.crash_metric
    return BenchmarkEntry(
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


def notes(outcome: BenchmarkOutcome, setting: Setting) -> list[str]:
    """What the contestants of a setting found out in advance, as lines for the reader."""
    return [f"{name}: {found['note']}" for name, found in outcome.preparations(setting.name).items()]


STYLES = {"match": "green", "near": "yellow", "miss": "red"}


def tables(outcome: BenchmarkOutcome) -> list[Table]:
    """The tables for the terminal."""
    return [_table(outcome.benchmark.problem, grid) for grid in grids(outcome)]


def _table(problem: str, grid: Grid) -> Table:
    rows = [[heading, *map(_styled, row)] for heading, row in grid.rows]
    caption = [grid.legend, *grid.notes]
    return Table(f"{problem}: {grid.title}", ["attacker", *grid.columns], rows, caption=caption)


def _styled(entry: BenchmarkEntry) -> Cell:
    lines = "\n".join(entry.paper_lines)
    return styled(lines, STYLES[entry.verdict], f"{entry.text}\n") if lines else entry.text


def agreement(outcome: BenchmarkOutcome) -> str:
    """How often our numbers agree with the paper's; empty where the paper prints none."""
    printed = [entry for entry in every_entry(outcome) if entry.difference is not None]
    if not printed:
        return ""
    distance = sum(abs(entry.difference or 0.0) for entry in printed) / len(printed)
    counts = ", ".join(f"{sum(entry.verdict == name for entry in printed)} {name}" for name in STYLES)
    crashes = [entry.crash_agrees for entry in printed if entry.crash_agrees is not None]
    flags = f"; crash or not agrees in {sum(crashes)} of {len(crashes)}" if crashes else ""
    return f"{len(printed)} cells printed in the paper: {counts}, {distance:.2f} points away on average{flags}."


def markdown(outcome: BenchmarkOutcome) -> str:
    """All tables as Markdown."""
    lines = [f"## {outcome.benchmark.problem}", ""]
    for grid in grids(outcome):
        lines += [f"### {grid.title}", "", f"{grid.legend}.", ""]
        lines += [*_table("", grid).markdown(), "", *(f"- {note}" for note in grid.notes), ""]
    lines += [*(f"- {note}" for note in outcome.benchmark.notes), "", agreement(outcome), ""]
    return "\n".join(lines)


def document(outcomes: Sequence[BenchmarkOutcome], machine: Mapping[str, Any], wall_s: float) -> dict[str, Any]:
    """Everything, for machines."""
    return {**machine, "wall_s": round(wall_s, 1), "problems": [_problem(outcome) for outcome in outcomes]}


def _problem(outcome: BenchmarkOutcome) -> dict[str, Any]:
    benchmark = outcome.benchmark
    problem = find_problem(benchmark.problem)
    settings = [
        {
            "name": setting.name,
            "title": setting.title,
            "config": asdict(setting.venue.config),
            "preparations": outcome.preparations(setting.name),
            "cells": [_cell(outcome, entry) for row in entries(outcome, setting) for entry in row],
        }
        for setting in benchmark.settings
    ]
    return {"problem": problem.name, "version": problem.version, "notes": list(benchmark.notes), "settings": settings}


def _cell(outcome: BenchmarkOutcome, entry: BenchmarkEntry) -> dict[str, Any]:
    metrics = outcome.result((entry.setting, entry.attacker, entry.defender))["metrics"]
    extra = {"difference": entry.difference, "verdict": entry.verdict, "crash_agrees": entry.crash_agrees}
    return {key: value for key, value in asdict(entry).items() if key != "means"} | extra | {"metrics": metrics}


def rows_as_csv(outcomes: Sequence[BenchmarkOutcome]) -> str:
    """One line per meeting: what is shown, the paper's number, and the mean of every metric."""
    found = [(outcome.benchmark.problem, entry) for outcome in outcomes for entry in every_entry(outcome)]
    metrics = list(dict.fromkeys(name for _, entry in found for name in entry.means))
    columns = ("problem", "setting", "attacker", "defender", "episodes", "metric", "value", "deviation")
    paper = ("paper", "difference", "verdict", "paper_crash")
    rows = [
        [
            problem,
            *(getattr(entry, name) for name in columns[1:]),
            entry.paper.value if entry.paper else None,
            entry.difference,
            entry.verdict,
            entry.paper.crash if entry.paper else None,
            *map(entry.means.get, metrics),
        ]
        for problem, entry in found
    ]
    return csv_text([*columns, *paper, *(f"mean_{name}" for name in metrics)], rows)


def heat_maps(outcome: BenchmarkOutcome) -> Iterator[tuple[str, Any]]:
    """A matplotlib figure for each table, by its name: the darker, the more damage; the same colours in all of them."""
    top = max((entry.value for entry in every_entry(outcome)), default=1.0)
    for grid in grids(outcome):
        rows = [row for _, row in grid.rows]
        yield (
            f"{find_problem(outcome.benchmark.problem).name}-{grid.name}",
            draw_matrix(
                np.array([[entry.value for entry in row] for row in rows]),
                [[_in_heat_map(entry) for entry in row] for row in rows],
                [heading for heading, _ in grid.rows],
                grid.columns,
                title=f"{grid.title}\n{grid.legend}",
                axis=grid.axis,
                limits=(0.0, max(top, 1e-9)),
            ),
        )


def _in_heat_map(entry: BenchmarkEntry) -> str:
    return entry.text + (f"\npaper {entry.paper.value:.2f}" if entry.paper else "")
