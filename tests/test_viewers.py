"""The pictures of every problem and of the test bed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.errors import MissingExtraError
from cps_envs.core.types import ROLES, Array, Role
from tests.pictured import Pictured
from tests.turns import in_turn

pygame = pytest.importorskip("pygame")
pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")

PICTURED: dict[str, Pictured] = {
    name: import_module(f"tests.{name}.pictures").PICTURED for name in (*PROBLEMS, "testbed")
}
SHAPE = (540, 960, 3)
EVERY = pytest.mark.parametrize("pictured", PICTURED.values(), ids=PICTURED)
ENVIRONMENTS = [(name, role) for name in PROBLEMS for role in ROLES]


def frame(pictured: Pictured, scene: Any) -> Array:
    picture: Array = pictured.viewer(pictured.config).frame(scene)
    return picture


def shown(pictured: Pictured) -> Any:
    return pictured.scenes[1] if pictured.shown is None else pictured.shown


def env_id(name: str, role: Role) -> str:
    return f"cps_envs:{PROBLEMS[name].env_id(role)}"


@EVERY
def test_a_frame_is_an_rgb_picture_as_large_as_all_others(pictured: Pictured) -> None:
    for scene in pictured.scenes:
        picture = frame(pictured, scene)
        assert picture.dtype == np.uint8
        assert picture.shape == SHAPE
        assert picture.flags.c_contiguous
        assert picture.flags.writeable


@EVERY
def test_a_new_episode_looks_the_same_whatever_was_drawn_before(pictured: Pictured) -> None:
    used, (start, *later) = pictured.viewer(pictured.config), pictured.scenes
    for scene in later:
        used.frame(scene)
    assert np.array_equal(used.frame(start), frame(pictured, start))
    if pictured.another is not None:
        used.frame(later[-1])
        assert np.array_equal(used.frame(pictured.another), frame(pictured, pictured.another))


@EVERY
def test_the_same_frames_give_the_same_pixels(pictured: Pictured) -> None:
    first, second = pictured.viewer(pictured.config), pictured.viewer(pictured.config)
    for scene in (*pictured.scenes, pictured.scenes[-1]):
        assert np.array_equal(first.frame(scene), second.frame(scene))


@pytest.mark.parametrize("name", [name for name, found in PICTURED.items() if hasattr(found.viewer, "watch")])
def test_curves_hold_what_was_only_watched(name: str) -> None:
    pictured = PICTURED[name]
    drawn, watching = pictured.viewer(pictured.config), pictured.viewer(pictured.config)
    start, under_way, *_ = pictured.scenes
    drawn.frame(start)
    watching.watch(start)
    assert np.array_equal(drawn.frame(under_way), watching.frame(under_way))
    assert not np.array_equal(watching.frame(under_way), frame(pictured, under_way))


def every_change() -> Iterator[object]:
    for name, pictured in PICTURED.items():
        for change in pictured.changes:
            yield pytest.param(pictured, change, id=f"{name}-{next(iter(change))}")


@pytest.mark.parametrize(("pictured", "change"), list(every_change()))
def test_everything_in_a_scene_is_visible(pictured: Pictured, change: dict[str, Any]) -> None:
    scene = shown(pictured)
    changed = replace(scene, **change)
    assert not np.array_equal(frame(pictured, scene), frame(pictured, changed))


@pytest.mark.parametrize(
    ("name", "size"), in_turn([(name, size) for name, found in PICTURED.items() for size in found.sizes], 3)
)
def test_any_size_and_setting_is_drawn(name: str, size: str) -> None:
    config, scenes = PICTURED[name].sizes[size]()
    viewer = PICTURED[name].viewer(config)
    assert {viewer.frame(scene).shape for scene in scenes} == {SHAPE}


@EVERY
def test_missing_pygame_names_the_extra(pictured: Pictured, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(MissingExtraError, match=r"cps-envs\[render\]"):
        pictured.viewer(pictured.config)


def test_no_display_is_opened_and_human_frames_are_drawn_off_screen_with_a_warning() -> None:
    games = [(env_id(name, "attacker"), PICTURED[name].options) for name in PROBLEMS]
    script = (
        "import os\n"
        "for name in ('SDL_VIDEODRIVER', 'DISPLAY', 'WAYLAND_DISPLAY'): os.environ.pop(name, None)\n"
        "before = dict(os.environ)\n"
        "import gymnasium, pygame\n"
        f"for name, options in {games!r}:\n"
        "    env = gymnasium.make(name, render_mode='rgb_array', interface='native', **options)\n"
        "    env.reset(seed=0)\n"
        f"    assert env.render().shape == {SHAPE}\n"
        "    assert not pygame.display.get_init(), name\n"
        "    assert {name: os.environ.get(name) for name in before} == before, name\n"
        "env = gymnasium.make('cps_envs/RogueAttack-v0', render_mode='human', interface='native', duration_s=1.0)\n"
        "env.reset(seed=0)\n"
        "env.step(env.action_space.sample())\n"
        "env.close()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert "there is no display to open a window on" in done.stderr or sys.platform != "linux"


@pytest.mark.parametrize(("name", "role"), ENVIRONMENTS)
def test_gymnasium_renders_arrays(name: str, role: Role) -> None:
    with gymnasium.make(
        env_id(name, role), render_mode="rgb_array", interface="native", **PICTURED[name].options
    ) as env:
        env.reset(seed=0)
        first = env.render()
        env.step(env.unwrapped.neutral_action)  # type: ignore[attr-defined]
        second = env.render()
    assert isinstance(first, np.ndarray)
    assert isinstance(second, np.ndarray)
    assert first.dtype == np.uint8
    assert first.shape == second.shape == SHAPE
    assert not np.array_equal(first, second)


@pytest.mark.parametrize(("name", "role"), ENVIRONMENTS)
def test_a_window_opens_and_closes(name: str, role: Role, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make(env_id(name, role), render_mode="human", interface="native", **PICTURED[name].options)
    env.reset(seed=0)
    assert pygame.display.get_surface().get_size() == (960, 540)
    env.step(env.unwrapped.neutral_action)  # type: ignore[attr-defined]
    env.close()
    assert not pygame.display.get_init()
