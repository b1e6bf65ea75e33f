"""Time in whole steps, from the hours that an observation shows."""

from __future__ import annotations

import numpy as np

from cps_envs.core.seen import Seen
from cps_envs.core.types import IntArray
from cps_envs.hvac.config import HvacConfig


def attack_age(seen: Seen, config: HvacConfig) -> IntArray:
    """Steps (B,) from the onset to the readings that an attacker's action forges; 0 before."""
    return _steps(seen, "attack_h", config)


def elapsed_steps(seen: Seen, config: HvacConfig) -> IntArray:
    """Steps (B,) since midnight of the first day."""
    return _steps(seen, "elapsed_h", config)


def _steps(seen: Seen, name: str, config: HvacConfig) -> IntArray:
    steps: IntArray = np.rint(seen[name] * (3600.0 / config.step_s)).astype(np.int64)
    return steps
