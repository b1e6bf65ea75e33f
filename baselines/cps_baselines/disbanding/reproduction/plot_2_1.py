"""Fig. 2.1: what one disbanded platoon does to the strings behind it, and what ten do."""

from __future__ import annotations

from typing import Any

from cps_baselines.disbanding.reproduction.experiments import STRINGS, TAUS_S, Evidence
from cps_baselines.disbanding.reproduction.recording import Record
from cps_baselines.reproduction.evidence import NotRunError
from cps_baselines.reproduction.figures import dress, new_figure, shades

PLATOONS = {20: "tab:red", 19: "tab:blue", 15: "goldenrod", 10: "tab:green", 1: "darkturquoise"}  # the paper's colours
TIME = "time / s"
LONGEST_GAP_M = 40.0  # the disbanded platoon's gaps go beyond


def draw(evidence: Evidence) -> Any:
    """All five panels."""
    figure = new_figure(11.0, 10.5)
    panels = figure.subplot_mosaic([["a", "b"], ["c", "d"], ["e", "e"]])
    twenty = evidence[evidence.experiments.string(STRINGS[0])]
    _positions(panels["a"], twenty)
    _gaps(panels["b"], twenty)
    _speeds(panels["c"], twenty)
    _strings(panels["d"], evidence)
    _every_other(panels["e"], evidence)
    interpretation = evidence.interpretation
    figure.suptitle(f"Fig. 2.1 recomputed ({interpretation}, tau = 0.1 s, x_d = 5 m)", fontsize=12)
    return figure


def _vehicles(axes: Any, record: Record, values: Any, platoons: dict[int, str]) -> None:
    """One thin line per vehicle, coloured and named by platoon."""
    for platoon, color in platoons.items():
        lines = axes.plot(record.time_s, values(platoon), color=color, linewidth=0.7)
        lines[0].set_label(f"platoon {platoon}")
    legend = axes.legend(fontsize=8, frameon=False)
    for line in legend.get_lines():
        line.set_linewidth(2.0)


def _positions(axes: Any, record: Record) -> None:
    _vehicles(axes, record, lambda platoon: record.position_m[:, record.vehicles(platoon)] / 1000.0, PLATOONS)
    dress(axes, "a) Positions; platoon 20 leads and is disbanded at 2 s", TIME, "position / km", x_limits=(0, 300))
    axes.set_ylim(-2.2, 9.0)


def _gaps(axes: Any, record: Record) -> None:
    _vehicles(axes, record, record.inner_gaps, PLATOONS)
    title = "b) Separations inside the platoons (those of platoon 20 go on growing)"
    dress(axes, title, TIME, "separation / m", x_limits=(0, 700))
    axes.set_ylim(0, LONGEST_GAP_M)
    axes.axhline(record.config.desired_gap_m, color="0.4", linewidth=0.8, linestyle=":")


def _speeds(axes: Any, record: Record) -> None:
    _vehicles(axes, record, lambda platoon: record.speed_mps[:, record.vehicles(platoon)], PLATOONS)
    dress(axes, "c) Speeds", TIME, "speed / (m/s)", x_limits=(0, 700))
    axes.set_ylim(0, 38)


def _strings(axes: Any, evidence: Evidence) -> None:
    for count, color in zip(STRINGS, shades(len(STRINGS)), strict=True):
        try:
            record = evidence[evidence.experiments.string(count)]
        except NotRunError:
            continue
        axes.plot(record.time_s, record.position_m[:, -1] / 1000.0, color=color, label=f"N = {count}")
    axes.legend(fontsize=8, frameon=False)
    dress(axes, "d) Rear vehicle of the string", TIME, "position / km", x_limits=(0, 1000))
    axes.set_ylim(-8, 20)


def _every_other(axes: Any, evidence: Evidence) -> None:
    record = evidence[evidence.experiments.every_other(TAUS_S[0])]
    size = record.config.vehicles_per_platoon
    platoons = [
        platoon
        for platoon in range(record.config.max_platoons, 0, -1)
        if record.outcome.intact[record.vehicles(platoon)].all()
    ]
    for platoon, color in zip(platoons, shades(len(platoons)), strict=True):
        rear = record.vehicles(platoon).start + size - 1
        axes.plot(record.time_s, record.speed_mps[:, rear], color=color, linewidth=1.0, label=str(platoon))
    axes.legend(title="platoon", fontsize=8, title_fontsize=8, frameon=False, ncols=2, loc="lower right")
    title = "e) Rear vehicles of the intact platoons; platoons 20, 18, ... 2 disbanded at 2, 32, ... 272 s"
    dress(axes, title, TIME, "speed / (m/s)", x_limits=(0, 450))
    axes.set_ylim(0, 38)
