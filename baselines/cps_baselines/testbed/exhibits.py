"""Fig. 2.5 as data: the three cases beside the paper and the reference, and E_v seed by seed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from cps_baselines.reproduction.exhibit import Column, Exhibit, Table
from cps_baselines.reproduction.regression import shipped_rows
from cps_baselines.testbed.cases import CASES, Case
from cps_baselines.testbed.claims import CLAIMS, deviation
from cps_baselines.testbed.plot import draw
from cps_baselines.testbed.results import ORDERED_SHARE, Results, needed


@dataclass(frozen=True)
class Spread:
    """E_v of a case in percent by the second implementation, over seeds of its own."""

    mean: float
    deviation: float
    seeds: int

    def allowance(self, num_seeds: int) -> float:
        """How far a mean over so many seeds may lie from this one: its deviation, for as many seeds as it has.

        Fewer seeds are allowed more, by the standard error of the difference of both means; more are not allowed less.
        """
        return self.deviation * max(1.0, math.sqrt((1 / num_seeds + 1 / self.seeds) * self.seeds / 2))


@lru_cache(maxsize=1)
def spreads() -> Mapping[str, Spread]:
    """Those of `reference.csv` by figure."""
    return {
        row["figure"]: Spread(float(row["mean"]), float(row["deviation"]), int(row["seeds"]))
        for row in shipped_rows("cps_baselines.testbed")
    }


def cases_table(results: Results) -> Table:
    """The three cases beside the paper and the reference, means over the seeds."""

    def mean(metric: str) -> Any:
        return lambda case: results.of(case).metrics[metric].mean()

    columns = (
        Column("", lambda case: (case.figure, case.name), "{} {}"),
        Column("Paper", lambda case: CLAIMS.number(case.claim), "{:.2f}"),
        Column("Ours", lambda case: results.errors(case).mean(), "{:.2f}"),
        Column("±", lambda case: deviation(results.errors(case)), "{:.2f}"),
        Column("min", lambda case: results.errors(case).min(), "{:.1f}"),
        Column("max", lambda case: results.errors(case).max(), "{:.1f}"),
        Column("Diff.", lambda case: results.errors(case).mean() - CLAIMS.number(case.claim), "{:+.1f}"),
        Column("Reference", lambda case: spreads()[case.figure].mean, "{:.1f}"),
        Column("±", lambda case: spreads()[case.figure].deviation, "{:.1f}"),
        Column("lowest m/s", mean("lowest_speed_mps"), "{:.3f}"),
        Column("stop", mean("stopped"), "{:.1f}"),
        Column("gap m", mean("smallest_gap_m"), "{:.3f}"),
        Column("rms m/s²", mean("rms_acceleration_mps2"), "{:.3f}"),
    )
    note = (
        f"E_v (2.8) in percent of robots 1 to 6, true speeds, 20 to 50 s; mean and standard deviation over "
        f"{results.num_seeds} seeds, the same for every case. Reference: our own second implementation of the same "
        "model, other seeds. Then means of: lowest speed, robots that stop, smallest gap (bodies touch at 0.100 m) and "
        "rms acceleration."
    )
    return Table("Fig. 2.5 on the simulated test bed", columns, CASES, (note,), data=lambda case: _data(results, case))


def _data(results: Results, case: Case) -> dict[str, Any]:
    errors = results.errors(case)
    return {
        "figure": case.figure,
        "case": case.name,
        "defender": case.defender,
        "velocity_error_percent": {
            "paper": CLAIMS.number(case.claim),
            "mean": float(errors.mean()),
            "deviation": deviation(errors),
        },
        "metrics": results.of(case).metrics,
    }


def seeds_table(results: Results) -> Table:
    """E_v of each seed in each case."""
    columns = (
        Column("Seed", str),
        *(Column(case.name, results.errors(case).__getitem__, "{:.2f}") for case in CASES),
        Column("in order", lambda seed: "yes" if results.ordered[seed] else "no"),
    )
    ordered = f"{results.ordered.sum()} of {results.num_seeds} seeds"
    note = f"E_v falls from case to case in {ordered}; asked for: {ORDERED_SHARE:.0%}."
    return Table("E_v by seed / %", columns, range(results.num_seeds), (note,))


FIGURE_2_5: Exhibit[Results] = Exhibit(
    "2.5",
    "Fig. 2.5: the three experiments",
    needed,
    lambda results: [cases_table(results), seeds_table(results)],
    figures={"figure_2_5": draw},
)
