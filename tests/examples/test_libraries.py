"""Each short program runs where its library is installed; `python -m tools.peers` says what it learns."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
MOST_LINES, LIMIT_S = 41, 300.0
PROGRAMS = [  # file, library, role, algorithm
    ("plain_ppo", "torch", "FdiAttack", ""),
    ("plain_ppo", "torch", "FdiDefense", ""),
    *(("sb3_algorithms", "sb3_contrib", "FdiAttack", each) for each in ("PPO", "RecurrentPPO", "TRPO", "DQN", "QRDQN")),
    ("sb3_algorithms", "sb3_contrib", "DisbandingAttack", "MaskablePPO"),
    ("skrl_ppo", "skrl", "FdiAttack", ""),
    ("rllib_ppo", "ray.rllib", "FdiAttack", ""),
    ("rllib_duel", "ray.rllib", "FdiAttack", ""),
    ("tianshou_ppo", "tianshou", "FdiAttack", ""),
    ("evotorch_pgpe", "evotorch", "FdiAttack", ""),
    ("agilerl_ppo", "agilerl", "FdiAttack", ""),
    *(("benchmarl_mappo", "benchmarl", "FdiDefense", each) for each in ("mappo", "ippo", "qmix")),
]


def installed(library: str) -> bool:
    try:
        return find_spec(library) is not None
    except ModuleNotFoundError:
        return False


@pytest.mark.slow
@pytest.mark.parametrize(("file", "library", "role", "algorithm"), PROGRAMS)
def test_it_runs(file: str, library: str, role: str, algorithm: str, tmp_path: Path) -> None:
    if not installed(library):
        pytest.skip(f"{library} is not installed")
    command = [sys.executable, str(EXAMPLES / f"{file}.py"), "--role", role, "--cpu-seconds", "0.01", "--episodes", "2"]
    command += ["--algorithm", algorithm] if algorithm else []
    done = subprocess.run(
        [*command, "--out", "out.json"], cwd=tmp_path, capture_output=True, text=True, timeout=LIMIT_S, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads((tmp_path / "out.json").read_text())
    assert {name: len(each) for name, each in found.items()} == {"before": 2, "after": 2}
    assert "return before" in done.stdout


@pytest.mark.parametrize("file", sorted({program[0] for program in PROGRAMS}))
def test_it_is_short(file: str) -> None:
    """Beside its docstring, blank lines and imports."""
    lines = (EXAMPLES / f"{file}.py").read_text().split('"""', 2)[2].splitlines()
    assert sum(bool(line) and not line.startswith(("import ", "from ")) for line in lines) <= MOST_LINES
