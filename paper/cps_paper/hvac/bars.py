"""Figs. 4.4, 4.7 and 4.8, and attacks that come early: impacts by attack, defence and number of attacked sensors."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_paper.exhibit import Column, ExhibitTable, across, places
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import (
    ATTACKS,
    DAYS,
    DEFENCES,
    EARLY,
    EARLY_COUNTS,
    LEAST_MEAN,
    MODEL_FALLBACK,
    compared,
    early,
    undefended,
)
from cps_paper.hvac.impacts import failing_line, mean_rise_c, outcomes
from cps_paper.hvac.rules import CLAIMS
from cps_paper.hvac.scenario import DayOutcome

COUNTS = range(5)  # of attacked sensors in Fig. 4.4
FIGURES = {4: 7, 8: 8}  # number of sensors -> 4.7 or 4.8
EARLY_NOTE = (
    f"Mean (median) A_impact over {DAYS[4]} days, °C². The paper does not say when attacks start; from step 200 on "
    "they leave MTD2 at 1.2. Single days weigh heavily: then {s2} alone looks perfect and is chosen."
)


def undefended_tables(evidence: HvacEvidence) -> list[ExhibitTable]:
    """Fig. 4.4 in numbers."""
    (paper,) = (claim.paper_shown for claim in CLAIMS.printed() if claim.id == "C12")
    headings = ("attack", "none", *(", ".join(map(str, range(1, count + 1))) for count in range(1, 5)))
    rows = [(attacker, *(_impact(evidence[undefended(attacker, count)]) for count in COUNTS)) for attacker in ATTACKS]
    note = f"Mean ± standard deviation over {DAYS[4]} days, °C². Paper: {paper} for constant, 1."
    rise = ("over the same days without an attack", *(f"{each:+.1f} °C" for each in mean_rise_c(evidence)))
    zones = places("", *(f"zone {zone}" for zone in range(1, 5)))
    return [
        ExhibitTable("Fig. 4.4a: A_impact without a defence, by attacked sensors", places(*headings), rows, (note,)),
        ExhibitTable("Fig. 4.4b: mean rise while sensor 1 reads 22 °C", zones, [rise]),
    ]


def undefended_data(evidence: HvacEvidence) -> dict[str, Any]:
    """The same for JSON."""
    bars = {attacker: [_data(evidence[undefended(attacker, count)]) for count in COUNTS] for attacker in ATTACKS}
    return {"bars": bars, "mean_rise_c": mean_rise_c(evidence).tolist()}


def bars_tables(evidence: HvacEvidence, num_sensors: int) -> list[ExhibitTable]:
    """Figs. 4.7 and 4.8 in numbers."""
    counts = ("free", *map(str, range(1, num_sensors + 1)))
    rows = [
        (attacker, defender, *map(_impact, outcomes(evidence, num_sensors, attacker, defender)))
        for attacker in ATTACKS
        for defender in DEFENCES
    ]
    sets = [
        (
            defender,
            kind,
            *(f"{getattr(bar, field).mean():.1f}" for bar in outcomes(evidence, num_sensors, "random", defender)),
        )
        for defender in DEFENCES[1:]
        for kind, field in (("all", "distinct_sets"), ("intact", "intact_sets"))
    ]
    line = failing_line(evidence, num_sensors)
    note = (
        f"Mean ± standard deviation over {DAYS[num_sensors]} days, °C², by number of attacked sensors. A defence has "
        f"failed above {line:.1f} °C², the impact of attack-free days without any."
    )
    figure = f"Fig. 4.{FIGURES[num_sensors]}"
    title = f"{figure}a-c: A_impact with {num_sensors} sensors"
    return [
        ExhibitTable(title, places("attack", "defence", *counts), rows, (note,), left=2, grouped=1),
        ExhibitTable(
            f"{figure}d: sensor sets selected, random attack", places("defence", "sets", *counts), sets, left=2
        ),
    ]


def bars_data(evidence: HvacEvidence, num_sensors: int) -> dict[str, Any]:
    """Fig. 4.7 or 4.8: by attack and defence, attack-free first, then 1 to all sensors attacked, for JSON."""
    fallbacks = {"least_mean": LEAST_MEAN, "model": MODEL_FALLBACK}
    return {
        "failing_line_c2": failing_line(evidence, num_sensors),
        "bars": {
            attacker: {
                defender: list(map(_data, outcomes(evidence, num_sensors, attacker, defender))) for defender in DEFENCES
            }
            for attacker in ATTACKS
        },
        "all_attacked_by_fallback": {
            attacker: {
                name: _data(evidence[compared(num_sensors, attacker, defender, num_sensors)])
                for name, defender in fallbacks.items()
            }
            for attacker in ATTACKS
        },
    }


def early_table(evidence: HvacEvidence) -> ExhibitTable:
    """MTD2 against attacks that start before the window is full."""

    def impacts(attack: tuple[int, str], count: int) -> tuple[float, float]:
        days = evidence[early(*attack, count)].a_impact
        return float(days.mean()), float(np.median(days))

    columns = (
        Column("onset step", lambda attack: attack[0]),
        Column("attack", lambda attack: attack[1]),
        *across(EARLY_COUNTS, "{} of 4".format, impacts, "{:.1f} ({:.1f})"),
    )
    title = "Not in the paper: MTD2 under attacks that come before it is ready"
    return ExhibitTable(title, columns, EARLY, (EARLY_NOTE,), left=2)


def early_data(evidence: HvacEvidence) -> list[dict[str, Any]]:
    """The same for JSON."""
    return [
        {
            "onset_step": onset,
            "attacker": attacker,
            "compromised": count,
            **_data(evidence[early(onset, attacker, count)]),
        }
        for onset, attacker in EARLY
        for count in EARLY_COUNTS
    ]


def _impact(outcome: DayOutcome) -> str:
    days = outcome.a_impact
    digits = 1 if days.mean() < 100.0 else 0
    return f"{days.mean():.{digits}f} ± {days.std(ddof=1):.{digits}f}"


def _data(outcome: DayOutcome) -> dict[str, Any]:
    days = outcome.a_impact
    return {
        "days": len(days),
        "a_impact": {"mean": float(days.mean()), "median": float(np.median(days)), "std": float(days.std(ddof=1))},
        "distinct_sets": float(outcome.distinct_sets.mean()),
        "intact_sets": float(outcome.intact_sets.mean()),
        "rejecting_share": float(outcome.rejecting_steps.mean() / outcome.full_window_steps),
    }
