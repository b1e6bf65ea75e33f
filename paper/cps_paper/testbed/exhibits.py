"""Fig. 2.5 as data: the three cases beside the paper and the reference, E_v seed by seed, and the figure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from cps_paper.exhibit import Column, Exhibit, ExhibitTable
from cps_paper.figures import add_legend, curves, dress, new_figure, shades
from cps_paper.testbed.cases import CASES, ORDERED_SHARE, Case, Results, needed
from cps_paper.testbed.claims import CLAIMS, deviation
from cps_paper.testbed.robots.config import BASELINE
from cps_paper.verdicts import shipped_rows

DISBANDED_COLOR = "0.55"


def draw_cases(results: Results) -> Any:
    """All four panels."""
    title = "Fig. 2.5 on the simulated test bed; platoon 3 (robots 7 to 9) disbands at 20 s"
    figure = new_figure(11.0, 7.5, title)
    panels = figure.subplot_mosaic("ab;cd")
    for letter, case in zip("abc", CASES, strict=True):
        _speeds(panels[letter], results, case, letter)
    add_legend(panels["b"], title="robot", loc="center left", bbox_to_anchor=(1, 0.5))
    _errors(panels["d"], results)
    return figure


def _speeds(axes: Any, results: Results, case: Case, letter: str) -> None:
    outcome, size = results.of(case), BASELINE.vehicles_per_platoon
    speeds_mps = outcome.speeds_mps[0]
    robots = speeds_mps.shape[1]
    time_s = outcome.step_s * np.arange(len(speeds_mps))
    names, colors = list(map(str, range(robots, 0, -1))), [DISBANDED_COLOR] * size + shades(robots - size)
    curves(axes, time_s, speeds_mps, names, colors, linewidth=0.9)
    axes.axhline(BASELINE.desired_speed_mps, color="0.4", linewidth=0.8, linestyle="--")
    title = (
        f"{letter}) {case.name}, seed 0: E_v = {results.errors(case)[0]:.1f} % (paper {CLAIMS.number(case.claim)} %)"
    )
    highest = BASELINE.max_speed_mps
    dress(axes, title, "time / s", "speed / (m/s)", x_limits=(0, time_s[-1]), y_limits=(0, highest))


def _errors(axes: Any, results: Results) -> None:
    places = np.arange(len(CASES))
    errors = np.array([results.errors(case) for case in CASES])  # (cases, seeds)
    axes.plot(places, errors, color="0.75", linewidth=0.8)
    axes.plot(places, errors, color="0.55", marker="o", markersize=3, linestyle="none")
    axes.plot(places, errors.mean(axis=1), color="black", marker="D", linestyle="none", label="ours, mean")
    paper = [CLAIMS.number(case.claim) for case in CASES]
    axes.plot(places, paper, color="tab:red", marker="x", markersize=9, linestyle="none", label="paper, one run")
    title, y = f"d) E_v, {results.num_seeds} seeds; a line joins the runs of one", "E_v of robots 1 to 6 / %"
    axes.set_xticks(places, [case.name for case in CASES])
    dress(axes, title, "", y, x_limits=(-0.4, len(CASES) - 0.6), legend={})


@dataclass(frozen=True)
class SeedSpread:
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
def spreads() -> Mapping[str, SeedSpread]:
    """Those of `reference.csv` by figure."""
    return {
        row["figure"]: SeedSpread(float(row["mean"]), float(row["deviation"]), int(row["seeds"]))
        for row in shipped_rows("cps_paper.testbed")
    }


def cases_table(results: Results) -> ExhibitTable:
    """The three cases beside the paper and the reference, means over the seeds."""

    def mean(metric: str) -> Any:
        return lambda case: results.of(case).metrics[metric].mean()

    known = results.damping == "k3"
    columns = (
        Column("", lambda case: (case.figure, case.name), "{} {}"),
        Column("Paper", lambda case: CLAIMS.number(case.claim), "{:.2f}"),
        Column("Ours", lambda case: results.errors(case).mean(), "{:.2f}"),
        Column("±", lambda case: deviation(results.errors(case)), "{:.2f}"),
        Column("min", lambda case: results.errors(case).min(), "{:.1f}"),
        Column("max", lambda case: results.errors(case).max(), "{:.1f}"),
        Column("Diff.", lambda case: results.errors(case).mean() - CLAIMS.number(case.claim), "{:+.1f}"),
        Column("Reference", lambda case: f"{spreads()[case.figure].mean:.1f}" if known else "-"),
        Column("±", lambda case: f"{spreads()[case.figure].deviation:.1f}" if known else "-"),
        Column("lowest m/s", mean("lowest_speed_mps"), "{:.3f}"),
        Column("stop", mean("stopped"), "{:.1f}"),
        Column("gap m", mean("smallest_gap_m"), "{:.3f}"),
        Column("rms m/s²", mean("rms_acceleration_mps2"), "{:.3f}"),
    )
    first_s, last_s = results.window_s
    note = (
        f"E_v (2.8) in percent of robots 1 to 6, true speeds, {first_s:g} to {last_s:g} s; mean and standard deviation "
        f"over {results.num_seeds} seeds, the same for each case. Reference: our own second implementation of the same "
        "model, other seeds. Then means of: lowest speed, robots that stop, smallest gap (bodies touch at 0.100 m) and "
        "rms acceleration."
    )
    return ExhibitTable(
        "Fig. 2.5 on the simulated test bed", columns, CASES, (note,), data=lambda case: _data(results, case)
    )


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


def seeds_table(results: Results) -> ExhibitTable:
    """E_v of each seed in each case."""
    columns = (
        Column("Seed", str),
        *(Column(case.name, results.errors(case).__getitem__, "{:.2f}") for case in CASES),
        Column("in order", lambda seed: "yes" if results.ordered[seed] else "no"),
    )
    ordered = f"{results.ordered.sum()} of {results.num_seeds} seeds"
    note = f"E_v falls from case to case in {ordered}; asked for: {ORDERED_SHARE:.0%}."
    return ExhibitTable("E_v by seed / %", columns, range(results.num_seeds), (note,))


FIGURE_2_5: Exhibit[Results] = Exhibit(
    "2.5",
    "Fig. 2.5: the three experiments",
    needed,
    lambda results: [cases_table(results), seeds_table(results)],
    figures={"figure_2_5": draw_cases},
)
