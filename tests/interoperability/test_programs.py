"""Programs of others that train: RL Baselines3 Zoo and CleanRL's ppo.py, unchanged."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
PPO = HERE.parents[1] / "tools" / "peers" / "cleanrl" / "ppo.py"
IDS = ("FdiAttack", "HvacAttack", "RogueAttack", "RogueDefense")


def run(folder: Path, *words: str) -> None:
    done = subprocess.run([sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-300:]


def test_rl_zoo(tmp_path: Path) -> None:
    """`python -m rl_zoo3.train --gym-packages cps_envs`"""
    pytest.importorskip("rl_zoo3")
    knobs = ["--conf-file", str(HERE / "rl_zoo.yml"), "-n", "600", "--eval-freq", "-1"]
    env = ["--env", "cps_envs/RogueAttack-v0", "--gym-packages", "cps_envs"]
    run(tmp_path, "-m", "rl_zoo3.train", "--algo", "ppo", *env, *knobs)


@pytest.mark.slow
@pytest.mark.parametrize("name", IDS)
def test_cleanrl(name: str, tmp_path: Path) -> None:
    """ppo.py of commit fe8d8a0 on every environment with one Discrete action"""
    pytest.importorskip("tyro")
    pytest.importorskip("tensorboard")
    knobs = ["--total-timesteps", "128", "--num-envs", "2", "--num-steps", "32", "--no-cuda"]
    run(tmp_path, str(PPO), "--env-id", f"cps_envs:cps_envs/{name}-v0", *knobs)
