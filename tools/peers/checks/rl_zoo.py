"""RL Baselines3 Zoo, with the hyperparameters beside this file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from trying import attempt

KNOBS = Path(__file__).with_name("rl_zoo.yml")


def train() -> None:
    command = ["--algo", "ppo", "--env", "cps_envs/RogueAttack-v0", "--gym-packages", "cps_envs", "--conf-file"]
    done = subprocess.run(
        [sys.executable, "-m", "rl_zoo3.train", *command, str(KNOBS), "-n", "600", "--eval-freq", "-1"],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr[-200:])


if __name__ == "__main__":
    attempt("`python -m rl_zoo3.train --gym-packages cps_envs`", train)
