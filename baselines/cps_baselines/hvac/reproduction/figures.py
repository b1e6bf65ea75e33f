"""The chapter's figures by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from cps_baselines.hvac.reproduction import plot_4_2, plot_4_4, plot_4_5, plot_4_6, plot_4_7
from cps_baselines.reproduction.evidence import Evidence

DRAWN: Mapping[str, Callable[[Evidence], Any]] = {
    "4.2fig": plot_4_2.draw_clear_day,
    "4.3fig": plot_4_2.draw_energies,
    "4.4fig": plot_4_4.draw,
    "4.5fig": plot_4_5.draw,
    "4.6fig": plot_4_6.draw,
    "4.7fig": partial(plot_4_7.draw, num_sensors=4),
    "4.8fig": partial(plot_4_7.draw, num_sensors=8),
}


def draw(evidence: Evidence, name: str) -> Any:
    """A figure, "4.2fig" to "4.8fig".

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    return DRAWN[name](evidence)
