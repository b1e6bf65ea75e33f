"""Fig. 2.5: speeds of the nine robots in each case, and the E_v of every seed beside the paper's."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_baselines.reproduction.figures import dress, new_figure, shades
from cps_baselines.testbed.cases import CASES, Case
from cps_baselines.testbed.claims import CLAIMS
from cps_baselines.testbed.results import Results
from cps_envs.testbed.config import BASELINE

DISBANDED_COLOR = "0.55"


def draw(results: Results) -> Any:
    """All four panels."""
    figure = new_figure(11.0, 7.5)
    panels = figure.subplot_mosaic([["a", "b"], ["c", "d"]])
    for letter, case in zip("abc", CASES, strict=True):
        _speeds(panels[letter], results, case, letter)
    panels["b"].legend(
        title="robot", fontsize=8, title_fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1, 0.5)
    )
    _errors(panels["d"], results)
    figure.suptitle("Fig. 2.5 on the simulated test bed; platoon 3 (robots 7 to 9) disbands at 20 s", fontsize=12)
    return figure


def _speeds(axes: Any, results: Results, case: Case, letter: str) -> None:
    outcome, size = results.of(case), BASELINE.vehicles_per_platoon
    speeds_mps = outcome.speeds_mps[0]
    robots = speeds_mps.shape[1]
    time_s = outcome.step_s * np.arange(len(speeds_mps))
    colors = shades(robots - size)
    for q in range(robots):
        color = DISBANDED_COLOR if q < size else colors[q - size]
        axes.plot(time_s, speeds_mps[:, q], color=color, linewidth=0.9, label=str(robots - q))
    axes.axhline(BASELINE.desired_speed_mps, color="0.4", linewidth=0.8, linestyle="--")
    title = (
        f"{letter}) {case.name}, seed 0: E_v = {results.errors(case)[0]:.1f} % (paper {CLAIMS.number(case.claim)} %)"
    )
    dress(axes, title, "time / s", "speed / (m/s)", x_limits=(0, time_s[-1]))
    axes.set_ylim(0, BASELINE.max_speed_mps)


def _errors(axes: Any, results: Results) -> None:
    places = np.arange(len(CASES))
    errors = np.array([results.errors(case) for case in CASES])  # (cases, seeds)
    axes.plot(places, errors, color="0.75", linewidth=0.8)
    axes.plot(places, errors, color="0.55", marker="o", markersize=3, linestyle="none")
    axes.plot(places, errors.mean(axis=1), color="black", marker="D", linestyle="none", label="ours, mean")
    paper = [CLAIMS.number(case.claim) for case in CASES]
    axes.plot(places, paper, color="tab:red", marker="x", markersize=9, linestyle="none", label="paper, one run")
    dress(axes, f"d) E_v, {results.num_seeds} seeds; a line joins the runs of one", "", "E_v of robots 1 to 6 / %")
    axes.set_xticks(places, [case.name for case in CASES])
    axes.set_xlim(-0.4, len(CASES) - 0.6)
    axes.legend(fontsize=8, frameon=False)
