from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError, MissingExtraError
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv
from cps_envs.core.picture.rendering import Renderer
from tests.core.toy import TOY, ToyAttackEnv, ToyAttackVectorEnv, ToyConfig, ToyGame


@pytest.mark.parametrize(
    "make",
    [
        lambda mode: ToyAttackEnv(render_mode=mode),
        lambda mode: ToyAttackVectorEnv(2, render_mode=mode),
        lambda mode: RolesParallelEnv(TOY, render_mode=mode),
        lambda mode: SwarmEnv(TOY, "defender", render_mode=mode),
    ],
)
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
