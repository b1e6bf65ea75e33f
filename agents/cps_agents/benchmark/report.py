"""A benchmark as tables on the terminal and as files: JSON, CSV, Markdown, heat maps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cps_agents.benchmark.matrix import Entry, Grid, entries, every_entry, grids
from cps_agents.benchmark.suite import Outcome
from cps_agents.heatmap import draw_matrix
from cps_agents.table import Cell, Table, csv_text, styled
from cps_envs import find_problem

STYLES = {"match": "green", "near": "yellow", "miss": "red"}


def tables(outcome: Outcome) -> list[Table]:
    """The tables for the terminal."""
    return [_table(outcome.benchmark.problem, grid) for grid in grids(outcome)]


def _table(problem: str, grid: Grid) -> Table:
    rows = [[heading, *map(_styled, row)] for heading, row in grid.rows]
    caption = [grid.legend, *grid.notes]
    return Table(f"{problem}: {grid.title}", ["attacker", *grid.columns], rows, caption=caption)


def _styled(entry: Entry) -> Cell:
    lines = "\n".join(entry.paper_lines)
    return styled(lines, STYLES[entry.verdict], f"{entry.text}\n") if lines else entry.text


def agreement(outcome: Outcome) -> str:
    """How often our numbers agree with the paper's; empty where the paper prints none."""
    printed = [entry for entry in every_entry(outcome) if entry.difference is not None]
    if not printed:
        return ""
    distance = sum(abs(entry.difference or 0.0) for entry in printed) / len(printed)
    counts = ", ".join(f"{sum(entry.verdict == name for entry in printed)} {name}" for name in STYLES)
    crashes = [entry.crash_agrees for entry in printed if entry.crash_agrees is not None]
    flags = f"; crash or not agrees in {sum(crashes)} of {len(crashes)}" if crashes else ""
    return f"{len(printed)} cells printed in the paper: {counts}, {distance:.2f} points away on average{flags}."


def markdown(outcome: Outcome) -> str:
    """All tables as Markdown."""
    lines = [f"## {outcome.benchmark.problem}", ""]
    for grid in grids(outcome):
        lines += [f"### {grid.title}", "", f"{grid.legend}.", ""]
        lines += [*_table("", grid).markdown(), "", *(f"- {note}" for note in grid.notes), ""]
    lines += [*(f"- {note}" for note in outcome.benchmark.notes), "", agreement(outcome), ""]
    return "\n".join(lines)


def document(outcomes: Sequence[Outcome], machine: Mapping[str, Any], wall_s: float) -> dict[str, Any]:
    """Everything, for machines."""
    return {**machine, "wall_s": round(wall_s, 1), "problems": [_problem(outcome) for outcome in outcomes]}


def _problem(outcome: Outcome) -> dict[str, Any]:
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


def _cell(outcome: Outcome, entry: Entry) -> dict[str, Any]:
    metrics = outcome.result((entry.setting, entry.attacker, entry.defender))["metrics"]
    extra = {"difference": entry.difference, "verdict": entry.verdict, "crash_agrees": entry.crash_agrees}
    return {key: value for key, value in asdict(entry).items() if key != "means"} | extra | {"metrics": metrics}


def rows_as_csv(outcomes: Sequence[Outcome]) -> str:
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


def heat_maps(outcome: Outcome) -> Iterator[tuple[str, Any]]:
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


def _in_heat_map(entry: Entry) -> str:
    return entry.text + (f"\npaper {entry.paper.value:.2f}" if entry.paper else "")
