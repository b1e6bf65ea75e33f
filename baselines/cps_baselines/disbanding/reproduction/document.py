"""The reproduction as plain data for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from cps_baselines.disbanding.reproduction.cells import AVERAGED, Cell, mean_distance
from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.disbanding.reproduction.experiments import FIGURE_TAUS_S, PLATOONS, TAUS_S
from cps_baselines.disbanding.reproduction.optimal import Optimum
from cps_baselines.disbanding.reproduction.played import DEFENDERS, READINGS
from cps_baselines.disbanding.reproduction.reference import Check
from cps_baselines.disbanding.reproduction.strings import courses


def table_document(cells: Sequence[Cell]) -> dict[str, Any]:
    """The cells of one table and their mean distances from the paper by controller."""
    rows = {name: [cell for cell in cells if cell.paper.controller == name] for name in _controllers(cells)}
    return {
        "averaged_over": AVERAGED[cells[0].table],
        "cells": [cell_document(cell) for cell in cells],
        "mean_absolute_difference": {
            name: {averaged: mean_distance(row, averaged) for averaged in ("intact", "all")}
            for name, row in rows.items()
        },
    }


def cell_document(cell: Cell) -> dict[str, Any]:
    """One cell; velocity errors in percent, differences in points."""
    return {
        **asdict(cell.paper),
        "velocity_error_percent": {"paper": cell.paper.velocity_error_percent, "ours": cell.ours, **cell.averages},
        "difference": cell.difference,
        "verdict": cell.verdict,
        "effect": None if cell.effect is None else {**asdict(cell.effect), "verdict": cell.effect.verdict},
        "crash": {"paper": cell.paper.crash, "ours": cell.outcome.crash, "agrees": cell.crash_agrees},
        "collided": int(cell.outcome.collided.sum()),
        "rear_collided": int(cell.outcome.rear_collided.sum()),
        "stopped_intact": int((cell.outcome.stops[cell.outcome.intact] > 0).sum()),
    }


def figure_2_1_document(evidence: Evidence) -> dict[str, Any]:
    """Fig. 2.1 in numbers."""
    platoons, strings, others = courses(evidence)
    return {
        "platoons": [asdict(row) for row in platoons],
        "strings": [asdict(row) for row in strings],
        "every_other": [asdict(row) for row in others],
    }


def figure_2_3_document(evidence: Evidence) -> list[dict[str, Any]]:
    """Figs. 2.3c and d, point by point."""
    points = []
    for tau_s in FIGURE_TAUS_S:
        for count in PLATOONS:
            outcome = evidence[evidence.experiments.single(count, tau_s)]
            points.append(
                {
                    "tau_s": tau_s,
                    "num_platoons": count,
                    "velocity_error_intact": outcome.velocity_error_intact,
                    "velocity_error_all": outcome.velocity_error_all,
                    "collided": int(outcome.collided.sum()),
                }
            )
    return points


def platoons_document(evidence: Evidence) -> list[dict[str, Any]]:
    """Every defender for every N: all metrics of the episode."""
    return [
        {
            "defender": name,
            "tau_s": tau_s,
            "num_platoons": count,
            **evidence[evidence.experiments.defended(count, tau_s, name)],
        }
        for name in DEFENDERS
        for tau_s in TAUS_S
        for count in PLATOONS
    ]


def text_document(evidence: Evidence) -> list[dict[str, Any]]:
    """Every defender under every reading of the text: the means of all metrics."""
    return [
        {
            "reading": each.name,
            "defender": name,
            "tau_s": tau_s,
            "episodes": each.episodes,
            **evidence[evidence.experiments.reading(each, tau_s, name)],
        }
        for each in READINGS
        for name in DEFENDERS
        for tau_s in TAUS_S
    ]


def search_document(rows: Sequence[Optimum]) -> list[dict[str, Any]]:
    """What the genetic algorithm found."""
    return [
        {
            "budget": row.budget,
            "tau_s": row.tau_s,
            "found": row.events,
            "velocity_error_all": row.found.value,
            "evaluations": row.found.evaluations,
            "simulations": row.found.simulations,
            "history": row.found.history,
            "paper_plan_error": row.paper_error,
            "grid": row.grid,
            "grid_error": row.grid_error,
            "best": row.best[0],
            "verdict": row.verdict,
        }
        for row in rows
    ]


def checks_document(checks: Sequence[Check]) -> dict[str, Any]:
    """The regression check."""
    return {
        "passed": all(check.passed for check in checks),
        "checks": [
            {
                "table": check.cell.table,
                "interpretation": check.cell.interpretation,
                "cell": check.cell.name,
                "difference": check.difference,
                "tolerance_points": check.reference.tolerance_points,
                "passed": check.passed,
                "crash_agrees": check.crash_agrees,
            }
            for check in checks
        ],
    }


def _controllers(cells: Sequence[Cell]) -> list[str]:
    return list(dict.fromkeys(cell.paper.controller for cell in cells))
