"""Scenes of heated buildings, for the tests of pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from cps_envs.core.types import Array
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.picture.scene import Scene
from cps_envs.hvac.picture.viewer import HvacViewer
from tests.hvac.games import go, started
from tests.pictured import Pictured, bumped

DAY: dict[str, Any] = {"num_steps": 150, "window_steps": 100, "onset_step": 105}
CONFIG = HvacConfig(**DAY)
MODEL = 15  # the last choice with four sensors
SHOWN_C = 22.0


def attacked(game: HvacGame, steps: int, choice: int = 0) -> list[Scene]:
    """The scenes of so many steps, in which compromised sensors show 22 C from the onset on."""
    forged = absolute_action(game.config, np.full((1, game.config.num_sensors), SHOWN_C))
    scenes = []
    for _ in range(steps):
        legal = choice if game.state.step[0] >= game.config.window_steps or choice == 0 else MODEL
        go(game, legal, forged)
        scenes.append(game.scene(0))
    return scenes


def played(steps: int, choice: int = 0, **overrides: Any) -> Scene:
    game = started(**{**DAY, **overrides})
    return attacked(game, steps, choice)[-1] if steps else game.scene(0)


def frame(scene: Scene, config: HvacConfig = CONFIG) -> Array:
    return HvacViewer(config).frame(scene)


def ring(zones: int, **overrides: Any) -> HvacConfig:
    """A building whose zones stand in a ring, the first half of them on the ground."""
    pairs = [(zone, zone % zones + 1) for zone in range(1, zones + 1)][: zones if zones > 2 else 1]
    settings: dict[str, Any] = {
        "heat_capacity_j_per_k": tuple(np.linspace(0.4e6, 0.9e6, zones).tolist()),
        "wall_resistance_k_per_w": tuple(np.linspace(0.1, 0.4, zones).tolist()),
        "link_zones": tuple(zone for pair in pairs for zone in pair),
        "link_resistance_k_per_w": tuple(np.linspace(0.01, 0.05, len(pairs)).tolist()),
        "ground_zones": tuple(range(1, zones // 2 + 1)),
        "num_sensors": zones,
        "num_compromised": 1,
        "sensor_sets": (1, 0, 2, 0, *range(1, zones)) if zones > 2 else (1, 0, 2),
    }
    return HvacConfig(**{**DAY, **settings, **overrides})


START, UNDER_WAY = played(0), played(120, 3)
OTHER_DAYS: Sequence[Mapping[str, Any]] = (
    {"num_sensors": 8},
    {"noise_std_c": 0.0},
    {"ground_zones": ()},
    {"ground_zones": (1, 2, 3, 4)},
    {"link_zones": (), "link_resistance_k_per_w": ()},
    {"reference_c": 20.0, "sensor_high_c": 90.0},
    {"onset_step": 0},
    {"num_compromised": 4},
    {"attack_action": "bias"},
)


def building(zones: int) -> tuple[HvacConfig, list[Scene]]:
    """A building with the first scenes of its day."""
    config = ring(zones)
    game = HvacGame(config, 1)
    game.reset(np.ones(1, np.bool_), [np.random.default_rng(0)])
    return config, attacked(game, 3)


def other_day(**changes: Any) -> tuple[HvacConfig, list[Scene]]:
    """An attacked day with other sensors, seasons or attacks."""
    game, scenes = started(**{**DAY, **changes}), []
    for _ in range(108):
        go(game, 0, np.full(game.action_space["attacker"].shape, -0.4))
        scenes.append(game.scene(0))
    return game.config, scenes


PICTURED = Pictured(
    viewer=HvacViewer,
    config=CONFIG,
    scenes=(START, UNDER_WAY),
    another=replace(UNDER_WAY, episode=99),
    changes=[
        {"step": 121},
        {"onset": 110},
        {"temperature": bumped(UNDER_WAY.temperature, 3, 1.0)},
        {"estimate": bumped(UNDER_WAY.estimate, 3, 1.0)},
        {"heating": bumped(UNDER_WAY.heating, 0, 200.0)},
        {"supplied": bumped(UNDER_WAY.supplied, 0, 200.0)},
        {"shift": bumped(UNDER_WAY.shift, 1, 2.0)},
        {"denied": np.array([True, False])},
        {"denied": np.array([False, True])},
        {"outdoor_c": UNDER_WAY.outdoor_c + 1.0},
        {"measured": bumped(UNDER_WAY.measured, 1, 1.0)},
        {"reading": bumped(UNDER_WAY.reading, 2, 1.0)},
        {"compromised": np.arange(4) == 1},
        {"choice": 0},
        {"choice": MODEL},
        {"ready": False},
        {"residual": bumped(UNDER_WAY.residual, 5, 3.0)},
        {"mean_residual": bumped(UNDER_WAY.mean_residual, 5, 3.0)},
        {"metrics": UNDER_WAY.metrics | {"a_impact": 7.0}},
        {"metrics": UNDER_WAY.metrics | {"mean_abs_error_c": 7.0}},
        {"metrics": UNDER_WAY.metrics | {"energy_kwh": 7.0}},
        {"metrics": UNDER_WAY.metrics | {"flawed_steps": 7.0}},
    ],
    sizes={
        **{f"{zones} zones": partial(building, zones) for zones in (2, 3, 4, 5, 9, 16)},
        **{str(dict(day)): partial(other_day, **day) for day in OTHER_DAYS},
    },
)
