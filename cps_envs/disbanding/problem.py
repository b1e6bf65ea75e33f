"""The disbanding problem as the faces see it."""

from __future__ import annotations

from cps_envs.core.problem import Problem, Work
from cps_envs.disbanding.config import PRESETS, DisbandingConfig
from cps_envs.disbanding.fields import attacker_fields, defender_fields
from cps_envs.disbanding.game import DisbandingGame


def vehicle_steps(config: DisbandingConfig) -> float:
    """Integration steps of single vehicles in a game step; a function of its own so that problems pickle."""
    return config.max_vehicles * config.steps_per_period


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
    viewer="cps_envs.disbanding.picture.viewer:Viewer",
    work=Work(
        unit="vehicle-steps",
        per_game_step=vehicle_steps,
        target_per_s=20e6,
    ),
)
