"""Scenes of platoons with a rogue vehicle, for the tests of pictures."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from cps_envs.core.types import Array
from cps_envs.rogue.config import PRESETS, RogueConfig
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.picture.scene import Scene
from cps_envs.rogue.picture.viewer import RogueViewer
from tests.pictured import Pictured, bumped

EVERY = np.ones(1, np.bool_)
CONFIG = RogueConfig()
SOLID = replace(CONFIG, contact="solid", power_ratio=1.3, duration_s=60.0)
DETECTING, HUMAN = CONTROLLERS.index("detecting"), CONTROLLERS.index("human")


def opened(config: RogueConfig, seed: int = 0) -> RogueGame:
    game = RogueGame(config, 1)
    game.reset(EVERY, [np.random.default_rng(seed)])
    return game


def drive(game: RogueGame, effort: float, law: int = DETECTING, modified: int = 0, periods: int = 1) -> Scene:
    """The scene after some periods of full driving (1) or braking (-1) under one law of all."""
    actions = {"attacker": np.array([[effort]])}
    if game.modes:
        actions["defender"] = np.tile([law, modified], game.config.num_intact)[np.newaxis]
    game.advance(actions, EVERY, periods)
    return game.scene(0)


def played(config: RogueConfig, seconds: float, law: int = DETECTING, modified: int = 0, seed: int = 0) -> Scene:
    """The scene under a square wave of 0.1 Hz."""
    game = opened(config, seed)
    scene = game.scene(0)
    for k in range(round(10 * seconds)):
        scene = drive(game, 1.0 if k % 100 < 50 else -1.0, law, modified)
    return scene


def frame(scene: Scene, config: RogueConfig = CONFIG) -> Array:
    return RogueViewer(config).frame(scene)


START, UNDER_WAY, SCATTERED = (played(CONFIG, seconds) for seconds in (0, 4, 60))
PUSHED = played(SOLID, 8)


def of_size(num_vehicles: int, seized: int, contact: str) -> tuple[RogueConfig, list[Scene]]:
    """A platoon of that many vehicles under two control laws."""
    config = replace(
        PRESETS["easy"], num_vehicles=num_vehicles, attacker_index=seized, contact=contact, duration_s=20.0
    )
    game = opened(config)
    return config, [drive(game, 1.0, law, 1, 80) for law in (DETECTING, HUMAN)]


def changed(**changes: Any) -> tuple[RogueConfig, list[Scene]]:
    """A second of the usual platoon with other numbers."""
    config = replace(CONFIG, **changes)
    return config, [played(config, 1)]


PICTURED = Pictured(
    viewer=RogueViewer,
    config=CONFIG,
    scenes=(START, UNDER_WAY, SCATTERED),
    another=played(CONFIG, 70, seed=1),
    changes=[
        {"time_s": 5.0},
        {"config": replace(CONFIG, duration_s=50.0)},
        {"attacker": 1},
        {"effort": 0.3},
        {"config": replace(CONFIG, min_effort=-2.0)},
        {"power_ratio": 1.2},
        {"position": bumped(UNDER_WAY.position, 0, -1.0)},
        {"position": UNDER_WAY.position + 3.1},
        {"speed": bumped(UNDER_WAY.speed, 1, 2.0)},
        {"acceleration": bumped(UNDER_WAY.acceleration, 3, -20.0)},
        {"reference_m": UNDER_WAY.reference_m + 5.0},
        {"reference_speed_mps": 29.0},
        {"growth": bumped(UNDER_WAY.growth, 0, 0.5)},
        {"law": ("linear", *UNDER_WAY.law[1:])},
        {"alarm": bumped(UNDER_WAY.alarm, 0, 1)},
        {"detector": UNDER_WAY.detector + 40.0},
        {"config": replace(CONFIG, contact="solid")},
        {"touching": np.arange(4) == 0},
        {"damage": bumped(UNDER_WAY.damage, 1, 3.0)},
        *({"metrics": UNDER_WAY.metrics | {name: 3.0}} for name in ("damage", "collisions", "alarms", "humans")),
        {"metrics": UNDER_WAY.metrics | {"first_alarm_s": 1.0}},
        {"metrics": UNDER_WAY.metrics | {"first_collision_s": 3.0}},
        {"metrics": UNDER_WAY.metrics | {"reference_error_m": 30.0}},
    ],
    sizes={
        **{
            f"{count} vehicles, {seized} seized, {contact}": partial(of_size, count, seized, contact)
            for contact in ("pass", "solid")
            for count, seized in ((3, 1), (3, 2), (5, 1), (5, 4), (10, 1), (20, 9), (20, 19))
        },
        "wide gaps": partial(changed, separation_m=100.0),
        "narrow gaps": partial(changed, separation_m=4.6),
        "short vehicles": partial(changed, vehicle_length_m=1.0, separation_m=2.0),
        "no braking": partial(changed, min_effort=0.0),
        "one second": partial(changed, duration_s=1.0),
        "commands": partial(changed, defense_action="command"),
        "walking pace": partial(changed, reference_speed_mps=1.0),
    },
)
