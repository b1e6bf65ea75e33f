"""The figures of the chapter, drawn: Fig. 2.1, what disbanded platoons do to strings, and Fig. 2.3, optimal attacks."""

from __future__ import annotations

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
from cps_paper.disbanding.scenario import Attack, ScenarioCourse
from cps_paper.evidence import NotRunError
from cps_paper.figures import MARKERS, dress, new_figure, shades

DRAWN = {20: "tab:red", 19: "tab:blue", 15: "goldenrod", 10: "tab:green", 1: "darkturquoise"}  # the paper's colours
TIME = "time / s"
LONGEST_GAP_M = 40.0  # the disbanded platoon's gaps go beyond


def draw_2_1(evidence: DisbandingEvidence) -> Any:
    """All five panels."""
    figure = new_figure(11.0, 10.5)
    panels = figure.subplot_mosaic([["a", "b"], ["c", "d"], ["e", "e"]])
    twenty = evidence[evidence.experiments.string(STRINGS[0])]
    _positions(panels["a"], twenty)
    _gaps(panels["b"], twenty)
    _speeds(panels["c"], twenty)
    _rear_positions(panels["d"], evidence)
    _rear_speeds_of_others(panels["e"], evidence)
    interpretation = evidence.interpretation
    figure.suptitle(f"Fig. 2.1 recomputed ({interpretation}, tau = 0.1 s, x_d = 5 m)", fontsize=12)
    return figure


def _vehicles(axes: Any, record: ScenarioCourse, values: Any, platoons: dict[int, str]) -> None:
    """One thin line per vehicle, coloured and named by platoon."""
    for platoon, color in platoons.items():
        lines = axes.plot(record.time_s, values(platoon), color=color, linewidth=0.7)
        lines[0].set_label(f"platoon {platoon}")
    legend = axes.legend(fontsize=8, frameon=False)
    for line in legend.get_lines():
        line.set_linewidth(2.0)


def _positions(axes: Any, record: ScenarioCourse) -> None:
    _vehicles(axes, record, lambda platoon: record.position_m[:, record.vehicles(platoon)] / 1000.0, DRAWN)
    dress(axes, "a) Positions; platoon 20 leads and is disbanded at 2 s", TIME, "position / km", x_limits=(0, 300))
    axes.set_ylim(-2.2, 9.0)


def _gaps(axes: Any, record: ScenarioCourse) -> None:
    _vehicles(axes, record, record.inner_gaps, DRAWN)
    title = "b) Separations inside the platoons (those of platoon 20 go on growing)"
    dress(axes, title, TIME, "separation / m", x_limits=(0, 700))
    axes.set_ylim(0, LONGEST_GAP_M)
    axes.axhline(record.config.desired_gap_m, color="0.4", linewidth=0.8, linestyle=":")


def _speeds(axes: Any, record: ScenarioCourse) -> None:
    _vehicles(axes, record, lambda platoon: record.speed_mps[:, record.vehicles(platoon)], DRAWN)
    dress(axes, "c) Speeds", TIME, "speed / (m/s)", x_limits=(0, 700))
    axes.set_ylim(0, 38)


def _rear_positions(axes: Any, evidence: DisbandingEvidence) -> None:
    for count, color in zip(STRINGS, shades(len(STRINGS)), strict=True):
        try:
            record = evidence[evidence.experiments.string(count)]
        except NotRunError:
            continue
        axes.plot(record.time_s, record.position_m[:, -1] / 1000.0, color=color, label=f"N = {count}")
    axes.legend(fontsize=8, frameon=False)
    dress(axes, "d) Rear vehicle of the string", TIME, "position / km", x_limits=(0, 1000))
    axes.set_ylim(-8, 20)


def _rear_speeds_of_others(axes: Any, evidence: DisbandingEvidence) -> None:
    record = evidence[evidence.experiments.every_other(TAUS_S[0])]
    size = record.config.vehicles_per_platoon
    platoons = [
        platoon for platoon in range(record.config.max_platoons, 0, -1) if record.intact[record.vehicles(platoon)].all()
    ]
    for platoon, color in zip(platoons, shades(len(platoons)), strict=True):
        rear = record.vehicles(platoon).start + size - 1
        axes.plot(record.time_s, record.speed_mps[:, rear], color=color, linewidth=1.0, label=str(platoon))
    axes.legend(title="platoon", fontsize=8, title_fontsize=8, frameon=False, ncols=2, loc="lower right")
    title = "e) Rear vehicles of the intact platoons; platoons 20, 18, ... 2 disbanded at 2, 32, ... 272 s"
    dress(axes, title, TIME, "speed / (m/s)", x_limits=(0, 450))
    axes.set_ylim(0, 38)


REAR_OF = tuple(range(9, 0, -1))  # platoons never disbanded in panel a


def draw_2_3(evidence: DisbandingEvidence) -> Any:
    """All four panels."""
    figure = new_figure(11.0, 7.5)
    panels = figure.subplot_mosaic([["a", "b"], ["c", "d"]])
    _rear_speeds(panels["a"], evidence, ((10, ATTACK_S),), "a) Platoon 10 disbanded at 2 s", "P21")
    _rear_speeds(panels["b"], evidence, ATTACKS["2.3"], "b) Platoon 10 at 2 s, platoon 9 at 100 s", "P22")
    _sweep(panels["c"], evidence, lambda outcome: outcome.velocity_error_intact)
    dress(panels["c"], "c) Lead platoon disbanded at 1 s", "number of platoons N", "E_v over intact vehicles / %")
    panels["c"].set_ylim(0)
    _sweep(panels["d"], evidence, lambda outcome: int(outcome.collided.sum()))
    dress(panels["d"], "d) Same attacks", "number of platoons N", "vehicles involved in collisions")
    lines, names = panels["a"].get_legend_handles_labels()
    panels["b"].legend(
        lines,
        names,
        title="rear vehicle\nof platoon",
        fontsize=8,
        title_fontsize=8,
        frameon=False,
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
    )
    figure.suptitle(f"Fig. 2.3 recomputed ({evidence.interpretation}, x_d = 5 m)", fontsize=12)
    return figure


def _rear_speeds(axes: Any, evidence: DisbandingEvidence, attack: Attack, title: str, claim_id: str) -> None:
    record = evidence[evidence.experiments.rear_speeds(attack)]
    size = record.config.vehicles_per_platoon
    disbanded = {platoon for platoon, _ in attack}
    for platoon, color in zip(REAR_OF, shades(len(REAR_OF)), strict=True):
        if platoon in disbanded:
            continue
        rear = record.vehicles(platoon).start + size - 1
        axes.plot(record.time_s, record.speed_mps[:, rear], color=color, linewidth=1.2, label=str(platoon))
    ((claim, finding),) = CLAIMS.evaluate(evidence, (claim_id,))
    dress(axes, f"{title}: E_v = {finding.value:.2f} %\n(paper {claim.number:.2f} %)", "time / s", "speed / (m/s)")
    axes.set_xlim(0, 180)
    axes.set_ylim(0, 38)


def _sweep(axes: Any, evidence: DisbandingEvidence, value: Any) -> None:
    colors = shades(len(FIGURE_TAUS_S))
    for tau_s, color, marker in zip(FIGURE_TAUS_S, colors, MARKERS, strict=True):
        values = [value(evidence[evidence.experiments.single(count, tau_s)]) for count in PLATOONS]
        axes.plot(PLATOONS, values, color=color, marker=marker, markersize=4, label=f"tau = {tau_s:g} s")
    axes.set_xticks(PLATOONS)
    axes.legend(fontsize=8, frameon=False)
