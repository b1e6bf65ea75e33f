from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.errors import MissingExtraError
from cps_envs.core.types import Array
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.picture.convoy import BEYOND_M, VEHICLE_M, lay_out
from cps_envs.disbanding.picture.palette import LEVELS, speed_level
from cps_envs.disbanding.picture.scene import Scene
from cps_envs.disbanding.picture.viewer import Viewer

ATTACK, DEFENSE = "cps_envs:cps_envs/DisbandingAttack-v0", "cps_envs:cps_envs/DisbandingDefense-v0"
EVERY = np.ones(1, np.bool_)
CONFIG = DisbandingConfig()

pygame = pytest.importorskip("pygame")


def played(config: DisbandingConfig, attacks: Mapping[int, int], seconds: int) -> Scene:
    """The scene after an attack {second: platoon}."""
    game = DisbandingGame(config, 1)
    game.reset(EVERY, [np.random.default_rng(0)])
    for second in range(seconds):
        game.advance({"attacker": np.array([attacks.get(second, 0)])}, EVERY, config.periods_per_second)
    return game.scene(0)


def frame(scene: Scene, config: DisbandingConfig = CONFIG) -> Array:
    return Viewer(config).frame(scene)


START = played(CONFIG, {}, 0)


def test_frame_is_an_rgb_picture_with_even_sides() -> None:
    picture = frame(START)
    assert picture.dtype == np.uint8
    assert picture.shape == (540, 960, 3)
    assert picture.flags.c_contiguous
    assert picture.flags.writeable


def test_same_scene_gives_the_same_pixels_whatever_was_drawn_before() -> None:
    used = Viewer(CONFIG)
    used.frame(played(CONFIG, {1: 10}, 10))
    assert np.array_equal(used.frame(START), frame(START))


@pytest.mark.parametrize(
    "change",
    [
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
    ids=lambda change: next(iter(change)),
)
def test_everything_in_a_scene_is_visible(change: dict[str, Any]) -> None:
    assert not np.array_equal(frame(START), frame(replace(START, **change)))


@pytest.mark.parametrize("num_platoons", [2, 4, 10, 13, 20])
def test_string_of_any_length_from_standstill_to_ghosts(num_platoons: int) -> None:
    config = DisbandingConfig(num_platoons=num_platoons, tau_s=0.5)
    scene = played(config, {1: num_platoons, 5: 1}, 40)
    scene.speed[-12:] = 0.0
    scene.position[-3:] = scene.position[-4] + np.array([-1.0, 2.0, 40.0])
    scene.collided[-4:] = True
    assert frame(scene, config).shape == (540, 960, 3)


def test_the_viewer_shows_whom_the_warning_has_reached() -> None:
    config = DisbandingConfig(warning="relayed")
    scene = played(config, {1: 10}, 4)
    assert scene.warned is not None
    warned = np.flatnonzero(scene.warned[10:])
    assert warned.tolist() == list(range(30))
    told = replace(scene, warned=np.ones(100, np.bool_))
    assert not np.array_equal(frame(scene, config), frame(told, config))


def test_absent_platoons_are_left_out() -> None:
    drawn = DisbandingConfig(num_platoons=(2, 10))
    scene = played(drawn, {}, 0)
    assert len(scene.disbanding_s) < 10
    assert np.array_equal(frame(scene, drawn), frame(scene, DisbandingConfig(num_platoons=len(scene.disbanding_s))))


@pytest.mark.parametrize(
    "changes",
    [
        {"vehicles_per_platoon": 2},
        {"vehicles_per_platoon": 50},
        {"desired_speed_mps": 1.0, "max_speed_mps": 1.0},
        {"num_platoons": 100},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_other_sizes_and_speeds(changes: dict[str, Any]) -> None:
    config = replace(CONFIG, **changes)
    assert frame(played(config, {1: 10}, 5), config).shape == (540, 960, 3)


def test_a_row_holds_a_platoon_in_steady_state_and_everything_fits_later() -> None:
    convoy = lay_out(START, CONFIG)
    assert convoy.rows == 10
    np.testing.assert_allclose(convoy.spans()[:, 0], BEYOND_M + np.arange(10) * convoy.row_m)
    stretched = lay_out(played(CONFIG, {1: 10}, 60), CONFIG)
    assert stretched.row_m > convoy.row_m
    assert stretched.behind_m.max() + VEHICLE_M <= stretched.road_m


def test_gaps_are_drawn_between_bumpers() -> None:
    convoy = lay_out(START, CONFIG)
    np.testing.assert_allclose(np.diff(convoy.behind_m), VEHICLE_M - np.diff(START.position))


def test_speed_scale_spans_the_speeds() -> None:
    assert speed_level(np.array([-1.0, 0.0, 36.0, 40.0]), 36.0).tolist() == [0, 0, LEVELS - 1, LEVELS - 1]


def test_no_display_is_opened() -> None:
    script = (
        "import os\n"
        "for name in ('SDL_VIDEODRIVER', 'DISPLAY', 'WAYLAND_DISPLAY'): os.environ.pop(name, None)\n"
        "before = dict(os.environ)\n"
        "import gymnasium, pygame\n"
        f"env = gymnasium.make({ATTACK!r}, render_mode='rgb_array')\n"
        "env.reset(seed=0)\n"
        "assert env.render().shape == (540, 960, 3)\n"
        "assert not pygame.display.get_init()\n"
        "assert {name: os.environ.get(name) for name in before} == before\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


@pytest.mark.parametrize("name", [ATTACK, DEFENSE])
def test_gymnasium_renders_arrays(name: str) -> None:
    with gymnasium.make(name, render_mode="rgb_array") as env:
        env.reset(seed=0)
        first = env.render()
        for _ in range(3):
            env.step(np.zeros_like(env.action_space.sample()))
        second = env.render()
    assert isinstance(first, np.ndarray)
    assert isinstance(second, np.ndarray)
    assert first.dtype == np.uint8
    assert first.shape == second.shape == (540, 960, 3)
    assert not np.array_equal(first, second)


def test_window_opens_and_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make(DEFENSE, render_mode="human")
    env.reset(seed=0)
    assert pygame.display.get_surface().get_size() == (960, 540)
    env.step(np.zeros(100, np.float32))
    env.close()
    assert not pygame.display.get_init()


def test_missing_pygame_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(MissingExtraError, match=r"cps-envs\[render\]"):
        Viewer(CONFIG)
