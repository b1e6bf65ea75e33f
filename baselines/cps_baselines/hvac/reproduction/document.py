"""The reproduction as plain data, ready for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cps_baselines.hvac.reproduction.cells import Row
from cps_baselines.hvac.reproduction.claims_4_4 import mean_rise_c
from cps_baselines.hvac.reproduction.clear_day import energy_days, zone_days
from cps_baselines.hvac.reproduction.estimation_errors import largest_errors_c, start_h
from cps_baselines.hvac.reproduction.experiments import (
    ATTACKS,
    DEFENCES,
    EARLY,
    EARLY_COUNTS,
    LEAST_MEAN,
    MODEL_FALLBACK,
    OBSERVERS,
    compared,
    early,
    undefended,
)
from cps_baselines.hvac.reproduction.impacts import failing_line, outcomes
from cps_baselines.hvac.reproduction.reference import Check
from cps_baselines.hvac.reproduction.scenario import Outcome
from cps_baselines.hvac.reproduction.sets import set_courses
from cps_baselines.reproduction.evidence import Evidence


def table_document(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """The cells of one table; errors in C."""
    return [
        {**asdict(cell.paper), "ours": cell.ours, "difference": cell.difference, "verdict": cell.verdict}
        for row in rows
        for cell in row.cells
    ]


def figure_document(evidence: Evidence, name: str) -> Any:
    """A figure, "4.2fig" to "4.8fig", in numbers."""
    if name == "4.2fig":
        return [asdict(day) for day in zone_days(evidence)]
    if name == "4.3fig":
        return [asdict(day) for day in energy_days(evidence)]
    if name == "4.4fig":
        return _undefended_document(evidence)
    if name == "4.5fig":
        return [_observer_document(evidence, *case) for case in OBSERVERS]
    if name == "4.6fig":
        return [{**asdict(each), "intact": each.intact, "selected": each.selected} for each in set_courses(evidence)]
    return bars_document(evidence, {"4.7fig": 4, "4.8fig": 8}[name])


def bars_document(evidence: Evidence, num_sensors: int) -> dict[str, Any]:
    """Fig. 4.7 or 4.8: by attack and defence, attack-free first, then 1 to all sensors attacked."""
    bars = {
        attacker: {
            defender: [_outcome_document(bar) for bar in outcomes(evidence, num_sensors, attacker, defender)]
            for defender in DEFENCES
        }
        for attacker in ATTACKS
    }
    fallbacks = {
        attacker: {
            name: _outcome_document(evidence[compared(num_sensors, attacker, defender, num_sensors)])
            for name, defender in (("least_mean", LEAST_MEAN), ("model", MODEL_FALLBACK))
        }
        for attacker in ATTACKS
    }
    line = failing_line(evidence, num_sensors)
    return {"failing_line_c2": line, "bars": bars, "all_attacked_by_fallback": fallbacks}


def early_document(evidence: Evidence) -> list[dict[str, Any]]:
    """Attacks before the window is full, under MTD2."""
    return [
        {
            "onset_step": onset,
            "attacker": attacker,
            "compromised": count,
            **_outcome_document(evidence[early(onset, attacker, count)]),
        }
        for onset, attacker in EARLY
        for count in EARLY_COUNTS
    ]


def checks_document(checks: Sequence[Check]) -> dict[str, Any]:
    """The regression check."""
    return {
        "passed": all(each.passed for each in checks),
        "inside": sum(each.inside for each in checks),
        "checks": [
            {
                "name": each.name,
                "ours": each.measure.value,
                "standard_error": each.measure.standard_error,
                **asdict(each.reference),
                "inside": each.inside,
                "passed": each.passed,
            }
            for each in checks
        ],
    }


def _undefended_document(evidence: Evidence) -> dict[str, Any]:
    bars = {
        attacker: [_outcome_document(evidence[undefended(attacker, count)]) for count in range(5)]
        for attacker in ATTACKS
    }
    return {"bars": bars, "mean_rise_c": mean_rise_c(evidence).tolist()}


def _observer_document(evidence: Evidence, sensors: tuple[int, ...], window_steps: int) -> dict[str, Any]:
    largest = largest_errors_c(evidence, (sensors, window_steps))
    return {
        "sensors": sensors,
        "window_steps": window_steps,
        "start_h": start_h(evidence, (sensors, window_steps)),
        "largest_error_c": {
            "median": np.median(largest, axis=0).tolist(),
            "lowest": largest.min(axis=0).tolist(),
            "highest": largest.max(axis=0).tolist(),
        },
    }


def _outcome_document(outcome: Outcome) -> dict[str, Any]:
    days = outcome.a_impact
    return {
        "days": len(days),
        "a_impact": {"mean": float(days.mean()), "median": float(np.median(days)), "std": float(days.std(ddof=1))},
        "distinct_sets": float(outcome.distinct_sets.mean()),
        "intact_sets": float(outcome.intact_sets.mean()),
        "rejecting_share": float(outcome.rejecting_steps.mean() / outcome.full_window_steps),
    }
