"""`Switching` with its weights as numbers of their own, so that a search can vary each of them."""

from __future__ import annotations

import numpy as np

from cps_baselines.rogue.switching import Switching
from cps_envs.core.policies.policy import RoleSpec


def tuned(
    spec: RoleSpec,
    front_gap: float = 1.0,
    front_rate: float = 0.0,
    rear_gap: float = 0.0,
    rear_rate: float = 0.0,
    excess: float = 0.0,
    bias: float = 0.0,
    hysteresis: float = 0.0,
) -> Switching:
    """Plays `switching` with these seven weights."""
    return Switching(spec, np.array([front_gap, front_rate, rear_gap, rear_rate, excess, bias, hysteresis]))
