"""A benchmark as tables on the terminal and as files: JSON, CSV, Markdown, heat maps.

They show attackers in rows, defenders or tasks in columns, the paper's number beside.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cps_agents.arena.play import Place
from cps_agents.heatmap import draw_matrix
from cps_agents.sheet import Cell, Sheet, csv_text, styled
from cps_envs import find_problem
from cps_envs.core.types import ROLES
from cps_paper.benchmark.schedule import PaperCell
from cps_paper.benchmark.suite import BenchmarkOutcome
from cps_paper.printed.tables import verdict


@dataclass(frozen=True)
class BenchmarkEntry:
    """A meeting: what came out, in numbers and as text."""

    table: str
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
    metrics: dict[str, list[float]]  # of the episodes

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


def every_entry(outcome: BenchmarkOutcome) -> list[BenchmarkEntry]:
    """The meetings of all tables."""
    return [
        entry for number in range(len(outcome.benchmark.tables)) for row in entries(outcome, number) for entry in row
    ]


def entries(outcome: BenchmarkOutcome, number: int) -> list[list[BenchmarkEntry]]:
    """The rows of a table."""
    rows, columns = (range(len(outcome.benchmark.tables[number].players(role))) for role in ROLES)
    return [[_entry(outcome, (number, row, column)) for column in columns] for row in rows]


def _entry(outcome: BenchmarkOutcome, place: Place) -> BenchmarkEntry:
    table, result = outcome.benchmark.tables[place[0]], outcome.result(place)
    attacker, defender = table.pair(place[1:]).values()
    meeting = (table.name, attacker.name, defender.name)
    means = {name: float(np.mean(values)) for name, values in result["metrics"].items()}
    metric = attacker.metric or table.metric
    share = means[metric] / ((means[table.per] if table.per else 0.0) or np.nan)
    shown = result["metrics"][metric]
    spread = dict(zip(("lower", "median", "upper"), np.quantile(shown, (0.25, 0.5, 0.75)).tolist(), strict=True))
    printed = [cell for cell in outcome.benchmark.paper if (cell.table, cell.attacker, cell.defender) == meeting]
    crashes = outcome.benchmark.crash_metric
    return BenchmarkEntry(
        *meeting,
        episodes=len(shown),
        metric=metric,
        value=means[metric],
        deviation=float(np.std(shown)),
        means=means,
        text=table.form.format(value=means[metric], share=share, **spread, **means),
        paper=printed[0] if printed else None,
        crash=means[crashes] > 0 if crashes else None,
        cpu_s=result["cpu_s"],
        metrics=result["metrics"],
    )


STYLES = {"match": "green", "near": "yellow", "miss": "red"}


def tables(outcome: BenchmarkOutcome) -> list[Sheet]:
    """The tables for the terminal."""
    return [_sheet(outcome, number) for number in range(len(outcome.benchmark.tables))]


def _sheet(outcome: BenchmarkOutcome, number: int) -> Sheet:
    table, found = outcome.benchmark.tables[number], entries(outcome, number)
    rows = [[each.heading, *map(_styled, row)] for each, row in zip(table.attackers, found, strict=True)]
    columns = ["attacker", *(each.heading for each in table.defenders)]
    return Sheet(f"{outcome.benchmark.problem}: {table.title}", columns, rows, caption=[table.legend])


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
    cells = f"{len(printed)} cell{'s' * (len(printed) > 1)}"
    return f"{cells} printed in the paper: {counts}, {distance:.2f} points away on average{flags}."


def markdown(outcome: BenchmarkOutcome) -> str:
    """All tables as Markdown."""
    lines = [f"## {outcome.benchmark.problem}", ""]
    for table, sheet in zip(outcome.benchmark.tables, tables(outcome), strict=True):
        lines += [f"### {table.title}", "", f"{table.legend}.", "", *sheet.markdown(), ""]
    lines += [*(f"- {note}" for note in outcome.benchmark.notes), "", agreement(outcome), ""]
    return "\n".join(lines)


def document(outcomes: Sequence[BenchmarkOutcome], machine: Mapping[str, Any], wall_s: float) -> dict[str, Any]:
    """Everything, for machines."""
    return {**machine, "wall_s": round(wall_s, 1), "problems": [_problem(outcome) for outcome in outcomes]}


def _problem(outcome: BenchmarkOutcome) -> dict[str, Any]:
    benchmark = outcome.benchmark
    problem = find_problem(benchmark.problem)
    found = [
        {
            "name": table.name,
            "title": table.title,
            "config": asdict(table.venue.config),
            "overrides": {each.name: dict(each.overrides) for each in table.defenders if each.overrides},
            "cells": [_cell(entry) for row in entries(outcome, number) for entry in row],
        }
        for number, table in enumerate(benchmark.tables)
    ]
    return {"problem": problem.name, "version": problem.version, "notes": list(benchmark.notes), "tables": found}


def _cell(entry: BenchmarkEntry) -> dict[str, Any]:
    plain = {key: value for key, value in asdict(entry).items() if key not in ("means", "metrics")}
    extra = {"difference": entry.difference, "verdict": entry.verdict, "crash_agrees": entry.crash_agrees}
    return plain | extra | {"metrics": entry.metrics}


def rows_as_csv(outcomes: Sequence[BenchmarkOutcome]) -> str:
    """One line per meeting: what is shown, the paper's number, and the mean of every metric."""
    found = [(outcome.benchmark.problem, entry) for outcome in outcomes for entry in every_entry(outcome)]
    metrics = list(dict.fromkeys(name for _, entry in found for name in entry.means))
    columns = ("problem", "table", "attacker", "defender", "episodes", "metric", "value", "deviation")
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
    for number, table in enumerate(outcome.benchmark.tables):
        rows = entries(outcome, number)
        yield (
            f"{find_problem(outcome.benchmark.problem).name}-{table.name}",
            draw_matrix(
                np.array([[entry.value for entry in row] for row in rows]),
                [[_in_heat_map(entry) for entry in row] for row in rows],
                [each.heading for each in table.attackers],
                [each.heading for each in table.defenders],
                title=f"{table.title}\n{table.legend}",
                axis=table.axis,
                limits=(0.0, max(top, 1e-9)),
            ),
        )


def _in_heat_map(entry: BenchmarkEntry) -> str:
    return entry.text + (f"\npaper {entry.paper.value:.2f}" if entry.paper else "")
