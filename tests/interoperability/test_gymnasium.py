"""Gymnasium's own checker, on a machine without a display too, as in most CI."""

from __future__ import annotations

import subprocess
import sys

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

import cps_envs  # noqa: F401

IDS = sorted(env_id for env_id in gymnasium.registry if str(env_id).startswith("cps_envs/"))
SHORT = {"cps_envs/RogueAttack-v0": {"duration_s": 3.0}, "cps_envs/RogueDefense-v0": {"duration_s": 3.0}}


@pytest.mark.parametrize("env_id", IDS)
def test_checker(env_id: str) -> None:
    check_env(gymnasium.make(env_id, **SHORT.get(env_id, {})).unwrapped, skip_render_check=True)


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
