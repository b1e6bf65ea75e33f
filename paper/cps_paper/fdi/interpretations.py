"""How chapter 3 can be read where it leaves something open: by name, what differs from preset `paper`, set A."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cps_envs.fdi.config import A

FIGURE: dict[str, Any] = {  # Algorithm 2 knows no limits of commands; its step 6 limits readings, see `figure_3_2`
    "num_vehicles": 10,
    "attacked": "x10",
    "target": 10,
    "horizon": 1200,
    "proportional_gain": 2.0,
    "dt_s": 0.05,
    "discretisation": "euler",
    "max_rate_injection_mps": 20.0,
    "limit_commands": False,
    "limit_readings": False,
    "paid_pair": "any",
}
INTERPRETATIONS: Mapping[str, Mapping[str, Any]] = {
    "B": {"proportional_gain": 2.0, "derivative_gain": 5.0, "min_acceleration_mps2": -8.0},
    "C": {"min_acceleration_mps2": -4.0, "max_acceleration_mps2": 4.0, "horizon": 25},
    "fig32": FIGURE,
    "instability": {  # the goal of section 3.3
        **FIGURE,
        "goal": "instability",
        "attacked": "xv10",
        "horizon": 800,
        "limit_commands": True,
        "limit_readings": True,
        "paid_pair": "target",
    },
    "clip": {"limits": "clip", "discretisation": "zohu", "dt_s": 0.1, "horizon": 40},
}
B = replace(A, **INTERPRETATIONS["B"])
C = replace(A, **INTERPRETATIONS["C"])
FIG_3_2 = replace(A, **INTERPRETATIONS["fig32"])
CLIP = replace(A, **INTERPRETATIONS["clip"])
