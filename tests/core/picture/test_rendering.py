"""Who draws and when; pictures as records and as SVG, from the same calls as those of pixels."""

from __future__ import annotations

import copy
import pickle
import sys
from dataclasses import replace
from importlib import import_module
from typing import Any
from xml.etree import ElementTree

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from cps_envs import PROBLEMS, find_problem
from cps_envs.core.errors import ConfigurationError, MissingExtraError
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv
from cps_envs.core.picture.canvas import Canvas
from cps_envs.core.picture.recording import Recorder
from cps_envs.core.picture.rendering import Renderer
from cps_envs.core.picture.svg import to_svg
from cps_envs.core.picture.viewer import CanvasViewer, recording_viewer
from tests.core.toy import TOY, ToyAttackEnv, ToyAttackVectorEnv, ToyConfig, ToyGame
from tests.pictured import Pictured

INK, WHITE = (20, 40, 60), (255, 255, 255)
SVG = "{http://www.w3.org/2000/svg}"
PICTURED: dict[str, Pictured] = {name: import_module(f"tests.{name}.pictures").PICTURED for name in PROBLEMS}


FORMS: list[Any] = [
    lambda mode: ToyAttackEnv(render_mode=mode),
    lambda mode: ToyAttackVectorEnv(2, render_mode=mode),
    lambda mode: RolesParallelEnv(TOY, render_mode=mode),
    lambda mode: SwarmEnv(TOY, "defender", render_mode=mode),
]


@pytest.mark.parametrize("make", FORMS)
@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_there_is_nothing_to_draw_before_the_first_reset(make: Any, mode: str) -> None:
    with pytest.raises(ResetNeeded, match="no episode has begun"):
        make(mode).render()


@pytest.mark.parametrize("make", FORMS)
@pytest.mark.parametrize("again", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_what_was_drawn_can_be_copied(make: Any, again: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make("rgb_array")
    env.reset(seed=0)
    shown = np.asarray(env.render())
    monkeypatch.setattr(env._renderer.viewer, "handle", sys, raising=False)  # of a viewer of somebody's own
    np.testing.assert_array_equal(np.asarray(again(env).render()), shown)


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_copy_goes_on_with_the_picture_of_the_episode(name: str) -> None:
    pytest.importorskip("pygame")
    env: Any = gymnasium.make(find_problem(name).env_id("attacker"), render_mode="rgb_array").unwrapped
    env.reset(seed=0)
    for _ in range(2):
        env.step(env.neutral_action)
        env.render()
    shown = []
    for each in (copy.deepcopy(env), pickle.loads(pickle.dumps(env)), env):
        each.step(env.neutral_action)
        shown.append(each.render())
    np.testing.assert_array_equal(shown[0], shown[2])
    np.testing.assert_array_equal(shown[1], shown[2])


@pytest.mark.parametrize("make", FORMS)
def test_every_face_draws_and_refuses_unknown_modes(make: Any) -> None:
    env = make("rgb_array")
    env.reset(seed=0)
    frames = env.render() if isinstance(env, ToyAttackVectorEnv) else (env.render(),)
    assert all(frame.shape == (32, 32, 3) for frame in frames)
    assert len(frames) == getattr(env, "num_envs", 1)
    env.close()
    silent = make(None)
    silent.reset(seed=0)
    assert silent.render() is None
    with pytest.raises(ConfigurationError, match="render_mode = 'ansi' is not one of None, 'rgb_array', 'human'"):
        make("ansi")


@pytest.mark.parametrize("make", [ToyAttackEnv, ToyAttackVectorEnv, lambda **kwargs: RolesParallelEnv(TOY, **kwargs)])
def test_human_mode_shows_each_step(make: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr("cps_envs.core.picture.rendering.FRAMES_PER_SECOND", 10_000)
    env = make(render_mode="human")
    env.reset(seed=0)
    assert env.render() is None
    if isinstance(env, RolesParallelEnv):
        env.step({"attacker_0": 0, "defender_0": np.zeros(2)})
    else:
        env.step(0 if isinstance(env, ToyAttackEnv) else [0])
    env.close()
    env.close()


def test_the_viewer_is_made_when_it_is_needed() -> None:
    game = ToyGame(ToyConfig(), 2)
    missing = Renderer(replace(TOY, viewer="no_such_viewer:Viewer"), game)
    with pytest.raises(ModuleNotFoundError):
        missing.frame()
    renderer = Renderer(TOY, game)
    assert renderer.frame(1).dtype == np.uint8


def test_a_problem_without_a_viewer_says_so() -> None:
    blind = replace(TOY, viewer="")
    assert recording_viewer(blind, ToyConfig()) is None
    with pytest.raises(ConfigurationError, match="names no viewer"):
        Renderer(blind, ToyGame(ToyConfig(), 1)).frame()


def test_a_window_without_pygame_names_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib

    def without(name: str) -> Any:
        raise ImportError(f"No module named {name!r}")

    env = ToyAttackEnv(render_mode="human")
    monkeypatch.setattr(importlib, "import_module", without)
    with pytest.raises(MissingExtraError, match=r"pip install \"cps-envs\[render\]\""):
        env.reset(seed=0)


class Witness:
    """A viewer that remembers, as those do that draw the course of an episode."""

    def __init__(self, config: ToyConfig) -> None:
        self.seen: list[Any] = []

    def watch(self, scene: Any) -> None:
        self.seen.append(scene)


def test_only_a_viewer_that_remembers_watches() -> None:
    game = ToyGame(ToyConfig(), 2)
    assert not Renderer(TOY, game).remembers
    renderer = Renderer(replace(TOY, viewer=f"{__name__}:Witness"), game)
    assert renderer.remembers
    renderer.watch(1)
    assert len(renderer.viewer.seen) == 1


@pytest.fixture
def recorder() -> Recorder:
    return Recorder(60, 40)


def test_filling_begins_a_new_picture(recorder: Recorder) -> None:
    recorder.box((0, 0, 5, 5), INK)
    recorder.fill(WHITE)
    assert recorder.shapes == [("fill", "#ffffff")]


def test_shapes_are_plain_numbers_to_a_tenth_of_a_pixel(recorder: Recorder) -> None:
    recorder.path([(1.04, 2.06), (3.0, 4.25)], INK)
    recorder.box((0.4, 0.6, 3.0, 0.2), INK, radius=2)
    recorder.circle((10.0, 10.0), 3.5, INK)
    assert recorder.shapes == [
        ("path", "#14283c", 1, 2.1, 3, 4.2),
        ("box", "#14283c", 0, 1, 3, 1, 2, 0),
        ("circle", "#14283c", 3.5, 10, 10),
    ]


def test_an_inner_clip_takes_the_place_of_the_outer_one(recorder: Recorder) -> None:
    with recorder.within((0, 0, 30, 30)), recorder.within((5, 5, 50, 20)):
        recorder.box((0, 0, 60, 40), INK)
    assert [shape[1:] for shape in recorder.shapes if shape[0] == "clip"] == [
        (0, 0, 30, 30),
        (5, 5, 50, 20),
        (0, 0, 30, 30),
        (),
    ]


def test_a_sprite_is_painted_once_for_each_key(recorder: Recorder) -> None:
    painted = []

    def paint(large: Canvas) -> None:
        painted.append(large)
        large.circle((24, 24), 20, INK)

    for x in (0.0, 10.0):
        recorder.sprite("disc", (12, 12), (x, 3.0), paint)
    assert len(painted) == len(recorder.sprites) == 1
    assert recorder.shapes == [("sprite", 0, 0, 3), ("sprite", 0, 10, 3)]


@pytest.mark.parametrize("text", ["Controller follows set 14", "24.0 °C", "Gap of each pair (m)", ""])
def test_text_is_as_wide_as_the_letters_of_pygame(text: str, recorder: Recorder) -> None:
    pytest.importorskip("pygame")
    from cps_envs.core.picture.pixels import PixelCanvas

    for size in (15, 22, 28):
        drawn = PixelCanvas(10, 10).text_width(text, INK, size)
        assert recorder.text_width(text, INK, size) == pytest.approx(drawn, abs=1.5 + 0.02 * drawn)


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_problem_is_recorded_without_pygame_and_written_as_svg(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    pictured, problem = PICTURED[name], find_problem(name)
    found = recording_viewer(problem, pictured.config)
    assert found is not None
    viewer, recorder = found
    for scene in pictured.scenes:
        viewer.draw(scene)
    root = ElementTree.fromstring(to_svg(recorder, "A < B"))
    assert root.findtext(f"{SVG}title") == "A < B"
    defined = {element.get("id") for element in root.iter() if element.get("id")}
    used = {element.get("href", "")[1:] for element in root.iter(f"{SVG}use")}
    assert used <= defined
    assert len(list(root.iter(f"{SVG}text"))) > 10


def test_a_viewer_on_a_recorder_has_no_pixels() -> None:
    class Blank(CanvasViewer):
        def draw(self, scene: object) -> None:
            self._canvas.fill(WHITE)

    with pytest.raises(TypeError, match="has no pixels"):
        Blank(None, Recorder(4, 4)).frame(None)
