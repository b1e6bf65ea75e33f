"""Fig. 2.3: speeds behind the optimal attacks, and what these attacks do over N and tau."""

from __future__ import annotations

from typing import Any

from cps_baselines.disbanding.reproduction.experiments import ATTACK_S, ATTACKS, FIGURE_TAUS_S, PLATOONS, Evidence
from cps_baselines.disbanding.reproduction.rules import CLAIMS
from cps_baselines.disbanding.reproduction.scenario import Attack
from cps_baselines.reproduction.figures import MARKERS, dress, new_figure, shades

REAR_OF = tuple(range(9, 0, -1))  # platoons never disbanded in panel a


def draw(evidence: Evidence) -> Any:
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


def _rear_speeds(axes: Any, evidence: Evidence, attack: Attack, title: str, claim_id: str) -> None:
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


def _sweep(axes: Any, evidence: Evidence, value: Any) -> None:
    colors = shades(len(FIGURE_TAUS_S))
    for tau_s, color, marker in zip(FIGURE_TAUS_S, colors, MARKERS, strict=True):
        values = [value(evidence[evidence.experiments.single(count, tau_s)]) for count in PLATOONS]
        axes.plot(PLATOONS, values, color=color, marker=marker, markersize=4, label=f"tau = {tau_s:g} s")
    axes.set_xticks(PLATOONS)
    axes.legend(fontsize=8, frameon=False)
