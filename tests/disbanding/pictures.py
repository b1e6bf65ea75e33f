"""Scenes of platoon strings, for the tests of pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from cps_envs.core.types import Array
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.picture.scene import Scene
from cps_envs.disbanding.picture.viewer import DisbandingViewer
from tests.pictured import Pictured

EVERY = np.ones(1, np.bool_)


CONFIG = DisbandingConfig()


def played(config: DisbandingConfig, attacks: Mapping[int, int], seconds: int) -> Scene:
    """The scene after an attack {second: platoon}."""
    game = DisbandingGame(config, 1)
    game.reset(EVERY, [np.random.default_rng(0)])
    for second in range(seconds):
        game.advance({"attacker": np.array([attacks.get(second, 0)])}, EVERY, config.periods_per_second)
    return game.scene(0)


def frame(scene: Scene, config: DisbandingConfig = CONFIG) -> Array:
    return DisbandingViewer(config).frame(scene)


START = played(CONFIG, {}, 0)


def of_length(num_platoons: int) -> tuple[DisbandingConfig, list[Scene]]:
    """A string of that many platoons whose rear stands still, or has run into one another."""
    config = DisbandingConfig(num_platoons=num_platoons, tau_s=0.5)
    scene = played(config, {1: num_platoons, 5: 1}, 40)
    scene.speed[-12:] = 0.0
    scene.position[-3:] = scene.position[-4] + np.array([-1.0, 2.0, 40.0])
    scene.collided[-4:] = True
    return config, [scene]


def changed(**changes: Any) -> tuple[DisbandingConfig, list[Scene]]:
    """Five seconds of the usual string with other numbers."""
    config = replace(CONFIG, **changes)
    return config, [played(config, {1: 10}, 5)]


PICTURED = Pictured(
    viewer=DisbandingViewer,
    config=CONFIG,
    scenes=(START, played(CONFIG, {1: 10}, 10)),
    shown=START,
    changes=[
        {"time_s": 1.0},
        {"position": START.position + 3.1},
        {"speed": START.speed - 5.0},
        {"disbanding_s": np.where(np.arange(10) == 3, 0.0, np.inf)},
        {"collided": np.arange(100) == 42},
        {"warned": np.zeros(100, bool)},
        {"jammed_after": 19},
        {"metrics": START.metrics | {"velocity_error_intact": 1.0}},
        {"metrics": START.metrics | {"stopped_share": 7.0}},
    ],
    sizes={
        **{f"{count} platoons": partial(of_length, count) for count in (2, 4, 10, 13, 20)},
        "pairs": partial(changed, vehicles_per_platoon=2),
        "50 vehicles each": partial(changed, vehicles_per_platoon=50),
        "walking pace": partial(changed, desired_speed_mps=1.0, max_speed_mps=1.0),
        "100 platoons": partial(changed, num_platoons=100),
    },
)
