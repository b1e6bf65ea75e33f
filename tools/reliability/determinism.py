"""The same seeds give the same trajectories, bit for bit, whatever surrounds the process."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from typing import Any

from tools.reliability.chunk import ROOT, Chunk, Part, Result
from tools.reliability.journal import Journal

PLACES = (ROOT, ROOT / "agents", ROOT / "baselines", ROOT / "paper")
ENVS, STEPS = 8, 60  # of a trajectory
PYTHONS = tuple(f"python3.{minor}" for minor in range(10, 15) if minor != sys.version_info.minor)
VARIANTS: Mapping[str, Mapping[str, str]] = {  # what is changed about the process
    "again": {},
    "other hash seeds": {"PYTHONHASHSEED": "1"},
    "four threads of libraries": {"OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4", "NUMBA_NUM_THREADS": "4"},
    "two threads of ours": {"RELIABILITY_THREADS": "2"},
    "kernels compiled anew": {"NUMBA_CACHE_DIR": "fresh"},
    "kernels compiled for any processor": {"NUMBA_CACHE_DIR": "fresh", "NUMBA_CPU_NAME": "generic"},
    "kernels as plain Python": {"NUMBA_DISABLE_JIT": "1"},
}


def chunks() -> list[Chunk]:
    """One for each variant, and for each version of Python that we support."""
    sources = (
        "cps_envs",
        "baselines/cps_baselines",
        "agents/cps_agents/zoo",
        "tools/reliability/determinism.py",
    )
    return [Chunk("determinism", row, 0, sources, limit_s=7200) for row in (*VARIANTS, *PYTHONS)]


def run(chunk: Chunk, journal: Journal) -> Result:
    """Compare trajectories of another process with those of a plain one."""
    if chunk.row in PYTHONS:
        return _other_python(chunk.row)
    with tempfile.TemporaryDirectory() as folder:
        change = {name: folder if value == "fresh" else value for name, value in VARIANTS[chunk.row].items()}
        return _compared(chunk.row, _hashes(sys.executable, {}), _hashes(sys.executable, change))


def _other_python(name: str) -> Result:
    none: Result = {"counts": dict.fromkeys(PART.columns, 0), "examples": {}}
    path = shutil.which(name)
    if path is None:
        return {**none, "lines": [f"{name} was not there to compare with."]}
    if subprocess.run([path, "-c", "import cps_baselines, numba, gymnasium"], capture_output=True).returncode:
        return {**none, "lines": [f"{name} was there, but without the packages that we need."]}
    return _compared(name, _hashes(sys.executable, {}), _hashes(path, {}))


def _compared(name: str, one: Mapping[str, str], other: Mapping[str, str]) -> Result:
    different = [key for key in one if other.get(key) != one[key]]
    examples = {"different": f"{name}: {', '.join(different)}"} if different else {}
    return {"counts": {"trajectories": len(one) * ENVS, "different": len(different) * ENVS}, "examples": examples}


def _hashes(python: str, change: Mapping[str, str]) -> dict[str, str]:
    """A hash of the trajectories of each environment and preset, from a process of its own.

    Raises:
        subprocess.CalledProcessError: the process fails.
    """
    surroundings = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, PLACES)), **change}
    command = [python, "-m", "tools.reliability.determinism"]
    done = subprocess.run(command, env=surroundings, check=True, capture_output=True, text=True)
    found: dict[str, str] = json.loads(done.stdout.splitlines()[-1])
    return found


def hashes(steps: int = STEPS) -> dict[str, str]:
    """By environment and preset: a hash of everything that the vector interface returned under random legal actions."""
    from cps_envs import PROBLEMS
    from cps_envs.core.types import ROLES

    found = {}
    for problem in PROBLEMS.values():
        for role in ROLES:
            for preset in ("paper", "learning"):
                found[f"{problem.env_id(role)} {preset}"] = _hash(problem.env_id(role), preset, steps)
    return found


def _hash(env_id: str, preset: str, steps: int) -> str:
    import gymnasium
    import numpy as np

    from cps_envs.core.conformance.actors import Crew

    env: Any = gymnasium.make_vec(env_id, num_envs=ENVS, preset=preset, interface="native")
    if env.game.threaded:
        env.game.use_threads(int(os.environ.get("RELIABILITY_THREADS", "1")))
    crew, digest = Crew(env, 5), hashlib.sha256()
    observation, info = env.reset(seed=11)
    digest.update(observation.tobytes())
    for _ in range(steps):
        observation, rewards, terminated, truncated, info = env.step(crew.act(info))
        for array in (observation, np.asarray(rewards), terminated, truncated):
            digest.update(array.tobytes())
    return digest.hexdigest()


PART = Part(
    name="determinism",
    title="The same seeds, the same trajectories",
    about=(
        f"{ENVS} episodes of each environment in the presets `paper` and `learning` run for {STEPS} steps under random "
        "legal actions. All observations, rewards and ends are hashed. Then another process does the same in other "
        "surroundings, and the hashes must be equal: bit for bit."
    ),
    columns={"trajectories": "trajectories", "different": "different"},
    forbidden=frozenset({"different"}),
    chunks=chunks,
    run=run,
)

if __name__ == "__main__":
    print(json.dumps(hashes()))
