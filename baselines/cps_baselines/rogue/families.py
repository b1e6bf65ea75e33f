"""The attacker `switching` as a family of policies whose numbers a search chooses."""

from __future__ import annotations

from cps_baselines.family import Family, Number
from cps_baselines.rogue.switching import Switching

WEIGHTS = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias", "hysteresis")  # as `tuned` names them
SWITCHING = Family(
    "rogue", "attacker", tuple(Number(name, float(name == "front_gap"), 1.0) for name in WEIGHTS), Switching
)
