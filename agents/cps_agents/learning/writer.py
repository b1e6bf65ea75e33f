"""Stable-baselines3's logger writes to a tracker."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.logger import KVWriter

from cps_agents.learning.tracking import Tracker


class TrackerWriter(KVWriter):
    """Hands on the numbers; text, figures and films stay behind."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker

    def write(self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0) -> None:
        """What one `dump` of the logger holds."""
        numbers = {
            name: float(value) for name, value in key_values.items() if isinstance(value, (int, float, np.number))
        }
        self._tracker.log(numbers, step)

    def close(self) -> None:
        """The tracker is closed where it was made."""
