"""What the drawings of courses over a day share: zones by colour, hours below, the onset."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_baselines.reproduction.figures import dress, shades
from cps_envs.core.types import FloatArray

HOURS = "time / h"
TEMPERATURE, ERROR = "temperature / °C", "error / °C"
REFERENCE = {"color": "0.3", "linewidth": 0.9, "linestyle": "--"}
ONSET = {"color": "tab:green", "linewidth": 1.0, "linestyle": ":"}


def draw_zones(axes: Any, time_h: FloatArray, values: FloatArray, *, title: str, y: str, style: str = "-") -> None:
    """One line per zone; values are (K, n) or one step shorter than `time_h` (K,)."""
    for zone, color in enumerate(shades(values.shape[1]), 1):
        label = f"zone {zone}" if style == "-" else None
        axes.plot(time_h[: len(values)], values[:, zone - 1], style, color=color, linewidth=1.0, label=label)
    dress(axes, title, HOURS, y, x_limits=(0.0, 24.0))
    axes.set_xticks(np.arange(0, 25, 4))


def name_zones(axes: Any, **where: Any) -> None:
    """A quiet legend."""
    axes.legend(fontsize=8, frameon=False, **where)
