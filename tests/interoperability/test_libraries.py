"""Gymnasium, PettingZoo and TorchRL on the registered environments, by their own utilities."""

from __future__ import annotations

import subprocess
import sys
from functools import partial
from importlib import import_module
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import api_test, max_cycles_test
from pettingzoo.utils import random_demo

from cps_envs import PROBLEMS
from cps_envs.core.errors import ConfigurationError
from tests.settings import tests_of as settings_of

IDS = sorted(env_id for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))
# TorchRL reads a MultiDiscrete of one entry as a number, which NumPy 2.4 refuses to convert: two attacked sensors.
OPTIONS = {"cps_envs/FdiAttack-v0": {"attacked": "xv4"}}
EACH = pytest.mark.parametrize("name", PROBLEMS)


def module_of(name: str) -> Any:
    return import_module(f"cps_envs.{name}_v0")


@pytest.mark.parametrize("env_id", IDS)
def test_gymnasium_accepts_what_it_makes(env_id: str) -> None:
    short = {"duration_s": 3.0} if "Rogue" in env_id else {}
    check_env(gymnasium.make(env_id, **short).unwrapped, skip_render_check=True)


def test_human_frames_without_a_display_are_drawn_off_screen_with_a_warning() -> None:
    code = (
        "import os\n"
        "for name in ('DISPLAY', 'WAYLAND_DISPLAY', 'SDL_VIDEODRIVER'):\n"
        "    os.environ.pop(name, None)\n"
        "import gymnasium, cps_envs\n"
        "env = gymnasium.make('cps_envs/RogueAttack-v0', render_mode='human', duration_s=1.0)\n"
        "env.reset(seed=0)\n"
        "env.step(env.action_space.sample())\n"
        "env.close()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    if sys.platform == "linux":
        assert "there is no display to open a window on" in done.stderr


@EACH
def test_episodes_are_cut_after_max_cycles(name: str) -> None:
    module = module_of(name)

    class Learning:  # in preset `paper` the random moves of a test end an FDI episode at once
        parallel_env = staticmethod(partial(module.parallel_env, preset="learning"))
        env = staticmethod(partial(module.env, preset="learning"))

    max_cycles_test(Learning)
    with pytest.raises(ConfigurationError, match="max_cycles = 0 must be a whole number, at least 1"):
        module.parallel_env(max_cycles=0)


@EACH
def test_the_turn_based_form_passes_its_test_and_the_random_demonstration(name: str) -> None:
    make, short = module_of(name).env, settings_of(name).short  # the parallel form: tests/test_conformance.py
    api_test(make(**short), num_cycles=50)
    random_demo(make(**short), render=False, episodes=1)


@pytest.mark.parametrize("env_id", IDS)
def test_torchrl_plays_single_environments(env_id: str) -> None:
    pytest.importorskip("torchrl")
    from torchrl.envs import GymEnv
    from torchrl.envs.utils import check_env_specs

    env = GymEnv(env_id, **OPTIONS.get(env_id, {}))
    check_env_specs(env)
    reward = env.rollout(5)["next", "reward"]
    assert np.isfinite(reward.numpy()).all()


@EACH
def test_torchrl_plays_duels(name: str) -> None:
    pytest.importorskip("torchrl")
    from torchrl.envs import PettingZooWrapper
    from torchrl.envs.utils import check_env_specs

    check_env_specs(PettingZooWrapper(module_of(name).parallel_env(), use_mask=True))
