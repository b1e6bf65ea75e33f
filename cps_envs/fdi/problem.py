"""The false-data-injection problem as the interfaces see it."""

from __future__ import annotations

from cps_envs.core.problem import Problem, Work
from cps_envs.fdi.config import PRESETS, FdiConfig
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.observation import attacker_fields, defender_fields


def decisions(config: FdiConfig) -> float:
    """Decisions in a game step of an episode; a function of its own so that problems pickle."""
    return 1.0


ATTACKERS = {  # where it is not the plain optimum
    "fig32": "bnb",
    "defense": 'mixture?policies=["none","oracle?start=random"]',
}

FDI = Problem(
    name="fdi",
    version=0,
    summary="An attacker falsifies range and range-rate readings to make vehicles collide; a defender doubts them.",
    presets=PRESETS,
    game=FdiGame,
    fields={"attacker": attacker_fields, "defender": defender_fields},
    opponents={preset: {"attacker": ATTACKERS.get(preset, "oracle"), "defender": "none"} for preset in PRESETS},
    viewer="cps_envs.fdi.picture.viewer:Viewer",
    work=Work(unit="decisions", per_game_step=decisions, vector_target_per_s=2e6),
)
