"""`cps-envs reproduce string-stability`: does a disturbance grow from platoon to platoon?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cps_agents.commands.options import AsJson
from cps_agents.console import err, out, print_json
from cps_agents.files import write_figure
from cps_agents.sheet import Sheet
from cps_paper.disbanding.string_stability import Peak
from cps_paper.disbanding.strings import LAGS_S, SIZES, STABLE_GAIN, Stability, analyse, draw
from cps_paper.figures import require_matplotlib


def string_stability(
    plot: Annotated[Path | None, typer.Option(metavar="FILE.png", help="Write a plot to this file.")] = None,
    as_json: AsJson = False,
) -> None:
    """Check whether a disturbance grows from platoon to platoon under the published controllers."""
    if plot is not None:
        require_matplotlib()
    stability = analyse()
    if as_json:
        print_json(_document(stability))
    else:
        rows = [(str(size), *(_cell(stability.peaks[size, tau_s]) for tau_s in LAGS_S)) for size in SIZES]
        console = out()
        columns = ("n", *(f"tau = {tau_s:g} s" for tau_s in LAGS_S))
        console.print(Sheet("Peak gain, and the frequency in rad/s and period where it lies", columns, rows))
        console.print(stability.verdict(), markup=False)
    if plot is not None:
        write_figure(plot, draw(stability))
        err().print(f"Written: {plot}", soft_wrap=True)


def _cell(peak: Peak) -> str:
    if peak.gain <= STABLE_GAIN:
        return f"{peak.gain:.3f}{'':15}"
    return f"{peak.gain:.3f}  {peak.frequency_rad_s:.3f} {peak.period_s:5.0f} s"


def _document(stability: Stability) -> dict[str, Any]:
    return {
        "peaks": [
            {
                "vehicles_per_platoon": size,
                "tau_s": tau_s,
                "gain": peak.gain,
                "frequency_rad_s": peak.frequency_rad_s,
                "period_s": peak.period_s,
            }
            for (size, tau_s), peak in stability.peaks.items()
        ],
        "stable_sizes": {f"{tau_s:g}": sizes for tau_s, sizes in stability.stable_sizes.items()},
        "verdict": stability.verdict(),
    }
