"""CleanRL's ppo.py, unchanged, on every environment with one Discrete action."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from trying import attempt

SCRIPT = Path(__file__).parents[1] / "cleanrl" / "ppo.py"
IDS = ("DisbandingAttack", "HvacDefense", "FdiAttackDiscrete", "FdiDefenseDiscrete", "RogueDefenseDiscrete")


def train(name: str) -> None:
    knobs = ["--total-timesteps", "128", "--num-envs", "2", "--num-steps", "32", "--no-cuda"]
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--env-id", f"cps_envs:cps_envs/{name}-v0", *knobs],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr[-200:])


if __name__ == "__main__":
    for env in IDS:
        attempt(f"ppo.py of commit fe8d8a0 on `{env}-v0`", lambda env=env: train(env))
