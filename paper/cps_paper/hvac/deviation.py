"""Table 4.1 read otherwise: its percentages as standard deviations of the noise, and what that asks of C12.

The text calls them variances. Read as deviations they let the errors of raw readings grow as the paper's do, with other
N and R; but the attack of C12, the one impact that the paper prints, then comes out otherwise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np

from cps_paper.claims import joined
from cps_paper.evidence import Experiment
from cps_paper.exhibit import DASH, Column, ExhibitTable, with_properties
from cps_paper.hvac.controllers import HvacEvidence
from cps_paper.hvac.experiments import PERCENTS, scenario
from cps_paper.hvac.rules import CLAIMS
from cps_paper.hvac.scenario import DayScenario
from cps_paper.printed.tables import tracking_errors
from cps_paper.verdicts import NEAR, NOT, REPRODUCED, of_number

DAYS = 4
TRIED = ((60, 0.05), (80, 0.25), (120, 0.25))  # N, R in C2/W2; the second is that of the preset


def raw(steps: int, weight: float, percent: int) -> DayScenario:
    """Days without a defence, with a noise whose standard deviation is so many percent of 1 C."""
    return scenario("none", "none", DAYS, **_settings(steps, weight), noise_std_c=percent / 100.0)


def attacked(steps: int, weight: float) -> DayScenario:
    """The attack of C12: sensor 1 reads 22 C."""
    return scenario("constant", "none", DAYS, **_settings(steps, weight), attack_order=(1,), num_compromised=1)


def _settings(steps: int, weight: float) -> dict[str, Hashable]:
    return {"controller": "clip", "prediction_steps": steps, "move_weight": weight}


def deviation_days() -> list[Experiment[Any]]:
    """Everything behind the table."""
    return [each for pair in TRIED for each in (attacked(*pair), *(raw(*pair, percent) for percent in PERCENTS["4.1"]))]


def printed_errors_c() -> list[float]:
    """The mean errors over the zones of the raw readings of Table 4.1, C."""
    cells = [cell for cell in tracking_errors("4.1") if cell.sensors_used == 0]
    return [
        float(np.mean([cell.mean_abs_error_c for cell in cells if cell.percent == percent]))
        for percent in PERCENTS["4.1"]
    ]


@dataclass(frozen=True)
class DeviationRow:
    """What a controller gives, or the paper prints."""

    steps: int | None  # N; None: the paper
    weight: float | None  # R, C2/W2
    errors_c: tuple[float, ...]  # at each percentage
    impact_c2: float  # of C12

    @property
    def error_verdicts(self) -> str:
        """On the errors, as "reproduced 2, near 1"."""
        if self.steps is None:
            return DASH
        found = Counter(of_number(*pair) for pair in zip(self.errors_c, printed_errors_c(), strict=True))
        return ", ".join(f"{word} {found[word]}" for word in (REPRODUCED, NEAR, NOT) if found[word])

    @property
    def impact_verdict(self) -> str:
        """On the impact."""
        return DASH if self.steps is None else of_number(self.impact_c2, CLAIMS.number("C12"))


def deviation_table(evidence: HvacEvidence) -> ExhibitTable:
    """A row for the paper and for each pair of N and R."""
    rows = [DeviationRow(None, None, tuple(printed_errors_c()), CLAIMS.number("C12"))]
    for pair in TRIED:
        errors = tuple(float(evidence[raw(*pair, each)].mean_abs_error_c.mean()) for each in PERCENTS["4.1"])
        rows.append(DeviationRow(*pair, errors, float(evidence[attacked(*pair)].a_impact.mean())))
    title = "Table 4.1 with its percentages as standard deviations, raw readings, controller clip"
    return ExhibitTable(title, COLUMNS, rows, (NOTE,), data=with_properties("error_verdicts", "impact_verdict"))


COLUMNS = (
    Column("N", lambda row: "paper" if row.steps is None else row.steps),
    Column("R", "weight", "{:g}"),
    Column(f"mean errors at {joined(PERCENTS['4.1'])} %", lambda row: joined(row.errors_c, ".2f"), "{} °C"),
    Column("verdicts", "error_verdicts"),
    Column("A_impact of C12", "impact_c2", "{:.0f} °C²"),
    Column("verdict", "impact_verdict"),
)
NOTE = (
    f"Means over the zones and {DAYS} days. The text calls the percentages variances, and part 4.1 takes them so. No "
    "N and R were found with which both the errors and C12 come out."
)
