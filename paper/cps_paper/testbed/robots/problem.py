"""The test bed as match, film and command line see it."""

from __future__ import annotations

from cps_envs.core.declare.fields import Fields
from cps_envs.core.game.problem import Problem
from cps_envs.disbanding.fields import attacker_fields, defender_fields
from cps_paper.testbed.robots.config import MITIGATED, PRESETS, RobotConfig
from cps_paper.testbed.robots.game import RobotGame

ATTACK = "plan?events=[[3, 20]]"  # section 2.5: the leading platoon; the time is chosen
DECREMENT_MPS2 = 0.02  # in the robots' metres; chosen
PERIOD_S = 0.5  # t_s of Fig. 2.5b


def attack_fields(config: RobotConfig) -> Fields:
    """What an attacker observes of the string."""
    return attacker_fields(config.road)


def defense_fields(config: RobotConfig) -> Fields:
    """What a defender observes of the string."""
    return defender_fields(config.road)


def mitigation(period_s: float, config: RobotConfig) -> str:
    """The name of the heuristic with t_s = `period_s`, samples of a control period, and bodies that have a length."""
    options = {
        "horizon_s": period_s,
        "sample_s": config.control_period_s,
        "decrement_mps2": config.scale * DECREMENT_MPS2,
        "clearance_m": config.scale * config.body_length_m,
        "avoidance": str(config.avoidance == "always").lower(),
    }
    return "heuristic?" + "&".join(f"{name}={value}" for name, value in options.items())


TESTBED = Problem(
    name="testbed",
    version=0,
    summary="Nine robots drive on a circle in three platoons. The leading platoon disbands.",
    presets=PRESETS,
    game=RobotGame,
    fields={"attacker": attack_fields, "defender": defense_fields},
    opponents={
        "paper": {"attacker": ATTACK, "defender": "none"},
        "mitigated": {"attacker": ATTACK, "defender": mitigation(PERIOD_S, MITIGATED)},
    },
    viewer="cps_paper.testbed.robots.picture.viewer:RobotViewer",
)
