"""Minari: a data set that our command wrote, read back by Minari."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from trying import attempt


def round_trip() -> None:
    shutil.rmtree("datasets", ignore_errors=True)
    os.environ["MINARI_DATASETS_PATH"] = str(Path("datasets").resolve())
    import minari

    command = "from cps_agents.command import main; main()"
    arguments = ["dataset", "fdi", "--role", "attacker", "--attacker", "bang_bang", "--episodes", "2"]
    done = subprocess.run([sys.executable, "-c", command, *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr[-200:])
    (name,) = [name for name in minari.list_local_datasets() if "fdi" in name.lower()][:1]
    assert minari.load_dataset(name).total_episodes == 2


if __name__ == "__main__":
    attempt("`cps-envs dataset`, then `minari.load_dataset`", round_trip)
