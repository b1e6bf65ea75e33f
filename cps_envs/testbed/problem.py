"""The test bed as match, film and command line see it."""

from __future__ import annotations

from cps_envs.core.fields import Fields
from cps_envs.core.problem import Problem
from cps_envs.disbanding.fields import attacker_fields, defender_fields
from cps_envs.testbed.config import PRESETS, RobotConfig
from cps_envs.testbed.game import RobotGame

ATTACK = "plan?events=[[3, 20]]"  # section 2.5: the leading platoon; the time is chosen


def attack_fields(config: RobotConfig) -> Fields:
    """What an attacker observes of the string."""
    return attacker_fields(config.road)


def defense_fields(config: RobotConfig) -> Fields:
    """What a defender observes of the string."""
    return defender_fields(config.road)


TESTBED = Problem(
    name="testbed",
    version=0,
    summary="Nine robots drive on a circle in three platoons. The leading platoon disbands.",
    presets=PRESETS,
    game=RobotGame,
    fields={"attacker": attack_fields, "defender": defense_fields},
    opponents={preset: {"attacker": ATTACK, "defender": "none"} for preset in PRESETS},
    viewer="cps_envs.testbed.picture.viewer:Viewer",
)
