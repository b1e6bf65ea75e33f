"""Scenes of robots on a circle, for the tests of pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cps_paper.testbed.robots.config import BASELINE, RobotConfig
from cps_paper.testbed.robots.picture.scene import Scene
from cps_paper.testbed.robots.picture.viewer import RobotViewer
from cps_paper.testbed.robots.problem import TESTBED
from tests.pictured import Pictured

ONE = np.ones(1, np.bool_)


def played(seconds: int, disbanded: int = 0, config: RobotConfig = BASELINE) -> Scene:
    """The scene after so many seconds, with a platoon disbanded after the first one."""
    game = TESTBED.game(config, 1)
    game.reset(ONE, [np.random.default_rng(0)])
    for second in range(seconds):
        game.advance({"attacker": np.array([disbanded if second == 1 else 0])}, ONE, 20)
    return game.scene(0)


START, AFTER = played(0), played(6, 3)
FOUR = replace(BASELINE, num_platoons=4, vehicles_per_platoon=4, radius_m=3.0)
PICTURED = Pictured(
    viewer=RobotViewer,
    config=BASELINE,
    scenes=(START, played(3), AFTER),
    shown=AFTER,
    changes=[
        {"time_s": 7.0},
        {"pose": AFTER.pose + 0.05},
        {"pose": AFTER.pose + np.array([0.0, 0.0, 1.0])},
        {"desired_arc_m": AFTER.desired_arc_m + 0.1},
        {"speeds": AFTER.speeds * 0.9},
        {"gaps": AFTER.gaps + 0.05},
        {"collided": ~AFTER.collided},
        {"disbanding_s": np.full(3, np.inf)},
        {"metrics": {**AFTER.metrics, "velocity_error": 99.9}},
    ],
    sizes={"four platoons of four": lambda: (FOUR, [played(2, 4, FOUR)])},
)
