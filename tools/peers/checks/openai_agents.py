"""A package with a top-level name that was once ours: both work, whoever was installed first."""

from __future__ import annotations

import subprocess
import sys

from trying import attempt


def both() -> None:
    for code in ("import agents; agents.Agent", "from cps_agents.command import main; main()"):
        done = subprocess.run([sys.executable, "-c", code, "--version"], capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr[-200:])


if __name__ == "__main__":
    attempt("`import agents`, and `cps-envs --version`", both)
