"""The tests of the kernels with numba's checks of every index, compiled into a folder of their own."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

from tools.reliability.chunk import ROOT, Chunk, Part, Result
from tools.reliability.journal import Journal

TESTS = {  # files by problem; those marked slow play every preset to its end
    "core": (
        "tests/core/compute/test_clock.py",
        "tests/core/declare/test_actions.py",
        "tests/core/interfaces/test_environments.py",
    ),
    "disbanding": ("tests/disbanding/test_reference.py", "tests/disbanding/test_radio.py"),
    "fdi": ("tests/fdi/test_game.py", "tests/fdi/test_model.py"),
    "hvac": ("tests/hvac/test_reference.py", "tests/hvac/test_building.py"),
    "rogue": ("tests/rogue/test_reference.py", "tests/rogue/test_dynamics.py"),
    "networks of trained policies": ("tests/agents/test_zoo_network.py",),
    "every preset of every problem": ("tests/core/compute/test_bounds.py",),
}
OPTIONS = (
    "-q",
    "--no-header",
    "-p",
    "no:cacheprovider",
    "-p",
    "no:xdist",
    "--hypothesis-seed=0",
    "-m",
    "slow or not slow",
)


def chunks() -> list[Chunk]:
    """One for each problem."""
    sources = (
        "cps_envs",
        "agents/cps_agents/zoo",
        "tests/core",
        "tests/disbanding",
        "tests/fdi",
        "tests/hvac",
        "tests/rogue",
    )
    return [Chunk("bounds", row, 0, sources, limit_s=7200) for row in TESTS]


def run(chunk: Chunk, journal: Journal) -> Result:
    """Run the tests and count them. A kernel that leaves its arrays raises an IndexError, which fails a test."""
    with tempfile.TemporaryDirectory() as cache:
        surroundings = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": cache, "CPS_ENVS_TRUST": "1"}
        command = [sys.executable, "-m", "pytest", *OPTIONS, *TESTS[chunk.row], "-rA", "--tb=line"]
        played = subprocess.run(command, cwd=ROOT, env=surroundings, capture_output=True, text=True)
    lines = played.stdout.splitlines()
    passed, failed = (sum(line.startswith(word) for line in lines) for word in ("PASSED", ("FAILED", "ERROR")))
    if not passed:
        raise RuntimeError(f"no test was run: {played.stdout[-1000:]} {played.stderr[-500:]}")
    shown = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return {"counts": {"passed": passed, "failed": failed}, "examples": {f"test {i}": t for i, t in enumerate(shown)}}


PART = Part(
    name="bounds",
    title="Kernels inside their arrays",
    about=(
        "Compiled kernels do not check indices. Here numba compiles them with such checks (NUMBA_BOUNDSCHECK=1), "
        "and the tests that use them run again. A kernel that reads or writes outside an array fails its test."
    ),
    columns={"passed": "tests passed", "failed": "failed"},
    forbidden=frozenset({"failed"}),
    chunks=chunks,
    run=run,
)
