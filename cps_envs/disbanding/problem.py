"""The disbanding problem as the faces see it."""

from __future__ import annotations

from cps_envs.core.problem import Problem
from cps_envs.disbanding.config import PRESETS
from cps_envs.disbanding.fields import attacker_fields, defender_fields
from cps_envs.disbanding.game import DisbandingGame

DISBANDING = Problem(
    name="disbanding",
    version=0,
    summary="An attacker disbands vehicle platoons; defenders correct commands so that traffic does not stop or crash.",
    presets=PRESETS,
    game=DisbandingGame,
    fields={"attacker": attacker_fields, "defender": defender_fields},
    opponents={
        "paper": {"attacker": "lead", "defender": "none"},
        "learning": {"attacker": "random", "defender": "none"},
    },
    viewer="cps_envs.disbanding.viewer:Viewer",
)
