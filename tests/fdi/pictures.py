"""Scenes of platoons with falsified readings, for the tests of pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from cps_envs.core.types import Array
from cps_envs.fdi.config import PRESETS, FdiConfig
from cps_envs.fdi.game import FdiGame
from cps_envs.fdi.picture.scene import Scene
from cps_envs.fdi.picture.viewer import FdiViewer
from cps_paper.fdi.interpretations import CLIP, FIG_3_2
from tests.pictured import Pictured, bumped

EVERY = np.ones(1, np.bool_)
CONFIG = FdiConfig()
DRAWN = "x4>4 xv1,2>1 v1,2,3,4>3"
CRASH = [-10, -10, -10, -10, -11, -11, -11, -3, 4, 10, 16, 22, 28, 34, 40, 46, 52, 58, 65, 71]  # levels of x4>4


def opened(config: FdiConfig, seed: int = 0) -> FdiGame:
    game = FdiGame(config, 1)
    game.reset(EVERY, [np.random.default_rng(seed)])
    return game


def inject(game: FdiGame, level: int | Sequence[int], replaced: Sequence[int] = ()) -> Scene:
    """The scene a step later; every attacked sensor gets the level, or its own; some readings are replaced."""
    n = game.config.num_vehicles
    attack = game.neutral_action["attacker"] + np.asarray(level)
    defense = game.neutral_action["defender"].copy()
    defense[list(replaced)] = 0
    actions = {"attacker": attack[np.newaxis]}
    if replaced:
        assert max(replaced) < 2 * n
        actions["defender"] = defense[np.newaxis]
    game.advance(actions, EVERY, 1)
    return game.scene(0)


def played(config: FdiConfig, levels: Sequence[int], replaced: Sequence[int] = ()) -> Scene:
    game = opened(config)
    scene = game.scene(0)
    for level in levels:
        scene = inject(game, level, replaced)
    return scene


def frame(scene: Scene, config: FdiConfig = CONFIG) -> Array:
    return FdiViewer(config).frame(scene)


START, UNDER_WAY, COLLISION = (played(CONFIG, CRASH[:steps]) for steps in (0, 12, 20))
ODD = (
    *(replace(preset, tasks=preset.tasks and DRAWN) for preset in PRESETS.values()),
    FIG_3_2,
    replace(CONFIG, desired_gap_m=0.5),
    replace(CONFIG, desired_gap_m=100.0, horizon=60),
    replace(CONFIG, range_resolution_m=0.001),
    replace(CLIP, attacked="xv1,2,3,4"),
    replace(CLIP, num_vehicles=20, attacked="xv" + ",".join(map(str, range(1, 21)))),
)


def of_length(num_vehicles: int) -> tuple[FdiConfig, list[Scene]]:
    """A platoon of that many vehicles, some readings of which are replaced."""
    config = replace(CLIP, num_vehicles=num_vehicles, attacked=f"x1,{num_vehicles}+v1", target=1)
    return config, [played(config, [4, 8, -8, 20], replaced=(0, num_vehicles))]


def odd(config: FdiConfig) -> tuple[FdiConfig, list[Scene]]:
    """The first steps under other numbers."""
    return config, [played(config, [1, 2, -1])]


PICTURED = Pictured(
    viewer=FdiViewer,
    config=CONFIG,
    scenes=(START, UNDER_WAY, COLLISION),
    changes=[
        {"time_s": 2.6},
        {"target": 3},
        {"gap": bumped(UNDER_WAY.gap, 0, 0.5)},
        {"closing_speed": bumped(UNDER_WAY.closing_speed, 1, 1.0)},
        {"reported_gap": bumped(UNDER_WAY.reported_gap, 3, -3.0)},
        {"attacked": np.arange(8) == 7},
        {"trusted": np.arange(8) != 2},
        {"injection": bumped(UNDER_WAY.injection, 3, 0.5)},
        {"command": bumped(UNDER_WAY.command, 0, -1.0)},
        {"metrics": UNDER_WAY.metrics | {"replaced_share": 0.1}},
        {"metrics": UNDER_WAY.metrics | {"oracle_bound_mps": 6.6}},
        {"metrics": UNDER_WAY.metrics | {"oracle_bound_mps": 6.6, "bound_valid": 1.0, "oracle_value_mps": 6.5}},
    ],
    sizes={
        **{f"{count} vehicles": partial(of_length, count) for count in (2, 3, 4, 5, 10, 20)},
        **{
            f"{place}: {config.num_vehicles} {config.attacked} {config.desired_gap_m:g} m": partial(odd, config)
            for place, config in enumerate(ODD)
        },
    },
    options={"opponent": "none"},
)
