"""RL Baselines3 Zoo, with the hyperparameters that we ship."""

from __future__ import annotations

import subprocess
import sys
from importlib.resources import as_file, files

from trying import attempt


def train() -> None:
    with as_file(files("cps_agents").joinpath("rl_zoo.yml")) as knobs:
        command = ["--algo", "ppo", "--env", "cps_envs/RogueAttack-v0", "--gym-packages", "cps_envs", "--conf-file"]
        done = subprocess.run(
            [sys.executable, "-m", "rl_zoo3.train", *command, str(knobs), "-n", "600", "--eval-freq", "-1"],
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode:
        raise RuntimeError(done.stderr[-200:])


if __name__ == "__main__":
    attempt("`python -m rl_zoo3.train --gym-packages cps_envs` with `cps_agents/rl_zoo.yml`", train)
