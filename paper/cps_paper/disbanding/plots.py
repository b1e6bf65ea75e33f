"""The figures of the chapter, drawn: Fig. 2.1, what disbanded platoons do to strings, and Fig. 2.3, optimal attacks."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from cps_paper.disbanding.experiments import (
    ATTACK_S,
    ATTACKS,
    FIGURE_TAUS_S,
    PLATOONS,
    STRINGS,
    TAUS_S,
    DisbandingEvidence,
)
from cps_paper.disbanding.rules import CLAIMS
from cps_paper.disbanding.scenario import Attack, ScenarioCourse, ScenarioOutcome
from cps_paper.evidence import NotRunError
from cps_paper.figures import add_legend, curves, dress, marked_curves, new_figure, shades

DRAWN = {20: "tab:red", 19: "tab:blue", 15: "goldenrod", 10: "tab:green", 1: "darkturquoise"}  # the paper's colours
TIME = "time / s"
SPEED = "speed / (m/s)"
SPEEDS_MPS = (0, 38)
LONGEST_GAP_M = 40.0  # the disbanded platoon's gaps go beyond


def draw_2_1(evidence: DisbandingEvidence) -> Any:
    """All five panels."""
    figure = new_figure(11.0, 10.5, f"Fig. 2.1 recomputed ({evidence.interpretation}, tau = 0.1 s, x_d = 5 m)")
    panels = figure.subplot_mosaic("ab;cd;ee")
    twenty = evidence[evidence.string(STRINGS[0])]
    title = "a) Positions; platoon 20 leads and is disbanded at 2 s"
    dress(panels["a"], title, TIME, "position / km", x_limits=(0, 300), y_limits=(-2.2, 9.0))
    _vehicles(panels["a"], twenty, lambda platoon: twenty.position_m[:, twenty.vehicles(platoon)] / 1000.0)
    title = "b) Separations inside the platoons (those of platoon 20 go on growing)"
    dress(panels["b"], title, TIME, "separation / m", x_limits=(0, 700), y_limits=(0, LONGEST_GAP_M))
    _vehicles(panels["b"], twenty, twenty.inner_gaps)
    panels["b"].axhline(twenty.config.desired_gap_m, color="0.4", linewidth=0.8, linestyle=":")
    dress(panels["c"], "c) Speeds", TIME, SPEED, x_limits=(0, 700), y_limits=SPEEDS_MPS)
    _vehicles(panels["c"], twenty, lambda platoon: twenty.speed_mps[:, twenty.vehicles(platoon)])
    _rear_positions(panels["d"], evidence)
    _rear_speeds_of_others(panels["e"], evidence)
    return figure


def _vehicles(axes: Any, record: ScenarioCourse, values: Callable[[int], Any]) -> None:
    """One thin line per vehicle, coloured and named by platoon."""
    for platoon, color in DRAWN.items():
        lines = axes.plot(record.time_s, values(platoon), color=color, linewidth=0.7)
        lines[0].set_label(f"platoon {platoon}")
    add_legend(axes, thick=True)


def _rear_positions(axes: Any, evidence: DisbandingEvidence) -> None:
    for count, color in zip(STRINGS, shades(len(STRINGS)), strict=True):
        with suppress(NotRunError):
            record = evidence[evidence.string(count)]
            axes.plot(record.time_s, record.position_m[:, -1] / 1000.0, color=color, label=f"N = {count}")
    title, y = "d) Rear vehicle of the string", "position / km"
    dress(axes, title, TIME, y, x_limits=(0, 1000), y_limits=(-8, 20), legend={})


def _rear_speeds_of_others(axes: Any, evidence: DisbandingEvidence) -> None:
    record = evidence[evidence.every_other(TAUS_S[0])]
    every = range(record.config.max_platoons, 0, -1)
    intact = [platoon for platoon in every if record.intact[record.vehicles(platoon)].all()]
    curves(axes, record.time_s, record.rear_speeds_mps(intact), list(map(str, intact)), linewidth=1.0)
    title = "e) Rear vehicles of the intact platoons; platoons 20, 18, ... 2 disbanded at 2, 32, ... 272 s"
    legend = {"title": "platoon", "ncols": 2, "loc": "lower right"}
    dress(axes, title, TIME, SPEED, x_limits=(0, 450), y_limits=SPEEDS_MPS, legend=legend)


REAR_OF = tuple(range(9, 0, -1))  # platoons never disbanded in panel a


def draw_2_3(evidence: DisbandingEvidence) -> Any:
    """All four panels."""
    figure = new_figure(11.0, 7.5, f"Fig. 2.3 recomputed ({evidence.interpretation}, x_d = 5 m)")
    panels = figure.subplot_mosaic("ab;cd")
    _rear_speeds(panels["a"], evidence, ((10, ATTACK_S),), "a) Platoon 10 disbanded at 2 s", "P21")
    _rear_speeds(panels["b"], evidence, ATTACKS["2.3"], "b) Platoon 10 at 2 s, platoon 9 at 100 s", "P22")
    _sweep(panels["c"], evidence, lambda outcome: outcome.velocity_error_intact)
    x, y = "number of platoons N", "E_v over intact vehicles / %"
    dress(panels["c"], "c) Lead platoon disbanded at 1 s", x, y, y_limits=(0,), legend={})
    _sweep(panels["d"], evidence, lambda outcome: int(outcome.collided.sum()))
    dress(panels["d"], "d) Same attacks", x, "vehicles involved in collisions", legend={})
    named = panels["a"].get_legend_handles_labels()
    add_legend(panels["b"], *named, title="rear vehicle\nof platoon", loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _rear_speeds(axes: Any, evidence: DisbandingEvidence, attack: Attack, title: str, claim_id: str) -> None:
    record, disbanded = evidence[evidence.rear_speeds(attack)], {platoon for platoon, _ in attack}
    drawn = {each: color for each, color in zip(REAR_OF, shades(len(REAR_OF)), strict=True) if each not in disbanded}
    speeds = record.rear_speeds_mps(list(drawn))
    curves(axes, record.time_s, speeds, list(map(str, drawn)), list(drawn.values()), linewidth=1.2)
    ((claim, finding),) = CLAIMS.evaluate(evidence, (claim_id,))
    said = f"{title}: E_v = {finding.value:.2f} %\n(paper {claim.number:.2f} %)"
    dress(axes, said, TIME, SPEED, x_limits=(0, 180), y_limits=SPEEDS_MPS)


def _sweep(axes: Any, evidence: DisbandingEvidence, value: Callable[[ScenarioOutcome], float]) -> None:
    def row(tau_s: float) -> list[float]:
        return [value(evidence[evidence.single(count, tau_s)]) for count in PLATOONS]

    marked_curves(axes, PLATOONS, {f"tau = {tau_s:g} s": row(tau_s) for tau_s in FIGURE_TAUS_S})
