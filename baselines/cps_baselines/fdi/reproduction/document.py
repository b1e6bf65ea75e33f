"""The reproduction as plain data, ready for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from cps_baselines.fdi.reproduction.audit import Comparison
from cps_baselines.fdi.reproduction.cells import Cell
from cps_baselines.fdi.reproduction.continuous import Continuous, verdict
from cps_baselines.fdi.reproduction.controls import TableControls
from cps_baselines.fdi.reproduction.counts import TableCounts
from cps_baselines.fdi.reproduction.figure import FigureRow
from cps_baselines.fdi.reproduction.settings import Settings
from cps_baselines.paper.collisions import CollisionCell


def cells_document(cells: Sequence[Cell]) -> list[dict[str, Any]]:
    """A table cell by cell; pairs by rear vehicle with relative speeds in m/s, closing < 0."""
    return [
        {
            "attacked": str(cell.paper.task.sensors),
            "target": cell.paper.task.target,
            "paper": dict(_named(cell.paper.speeds_mps)),
            "ours": dict(_named(cell.ours.pairs)),
            "distance": cell.ours.distance,
            "back_end": cell.ours.back_end,
            "statuses": cell.ours.statuses,
            "wall_s": cell.ours.wall_s,
            "injections": cell.ours.injections,
            "feasibility_agrees": cell.feasibility_agrees,
            "pairs_agree": cell.pairs_agree,
            "pairs_included": cell.pairs_included,
            "speed_agrees": cell.speed_agrees,
            "speed_difference_mps": cell.speed_difference_mps,
            "verdict": cell.verdict,
        }
        for cell in cells
    ]


def counts_document(counts: Sequence[TableCounts]) -> list[dict[str, Any]]:
    """The counts with their goals."""
    return [
        {
            "table": each.table,
            "cells": each.cells,
            "both_feasible": each.both_feasible,
            **each.counts._asdict(),
            "goals": None if each.goals is None else each.goals._asdict(),
            "passed": each.passed,
        }
        for each in counts
    ]


def audit_document(
    found: Sequence[Comparison], beyond: Sequence[tuple[CollisionCell, float | None]], printed: int
) -> dict[str, Any]:
    """All contradictions, and all speeds beyond the relaxation."""
    return {
        "comparisons": len(found),
        "contradictions": [
            {"fewer": _stated(each.fewer), "more": _stated(each.more), "drop_mps": each.drop_mps}
            for each in found
            if each.contradiction
        ],
        "printed_speeds": printed,
        "beyond_relaxation": [{**_stated(cell), "at_most_mps": fastest} for cell, fastest in beyond],
    }


def figure_document(rows: Sequence[FigureRow]) -> list[dict[str, Any]]:
    """Every variant of Fig. 3.2."""
    return [
        {
            "variant": row.run.variant.name,
            "attacked": str(row.paper.sensors),
            "paper": {
                "pair": row.paper.pair,
                "time_s": row.paper.time_s,
                "impact_speed_mps": row.paper.impact_speed_mps,
            },
            "ours": None if row.collision is None else row.collision._asdict(),
            "time_difference": row.time_difference,
            "speed_difference": row.speed_difference,
            "pair_agrees": row.pair_agrees,
            "lowest_reading_m": row.course.lowest_reading_m,
            "infeasible_calls": row.course.infeasible_calls,
            "verdict": row.verdict,
        }
        for row in rows
    ]


def controls_document(controls: Sequence[TableControls]) -> list[dict[str, Any]]:
    """How often simpler rules agree."""
    return [asdict(each) for each in controls]


def continuous_document(found: Sequence[Continuous]) -> dict[str, Any]:
    """Continuous injections against those that obey the resolution, by preset, and the verdict."""
    rows = [
        {
            **asdict(each),
            "unsettled": each.unsettled,
            "mean_ratio": each.mean_ratio,
            "notably_faster": each.notably_faster,
        }
        for each in found
    ]
    return {"presets": rows, "verdict": verdict(found)}


def settings_document(settings: Settings) -> dict[str, Any]:
    """What the cells were solved with."""
    return asdict(settings)


def _stated(cell: CollisionCell) -> dict[str, Any]:
    return {
        "table": cell.table,
        "attacked": str(cell.task.sensors),
        "target": cell.task.target,
        "speed_mps": cell.target_speed_mps,
    }


def _named(speeds_mps: Sequence[tuple[int, float]]) -> list[tuple[str, float]]:
    return [(f"{pair}-{pair + 1}", speed) for pair, speed in speeds_mps]
