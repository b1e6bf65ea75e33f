"""The distribution of compiled kernels: its wheel, and a fresh environment that compiles nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
from pathlib import Path
from zipfile import ZipFile

import numba
import pytest

import cps_envs
from cps_envs.core.compute.shipped import PACKAGE, PROCESSOR, runs_here
from tools import kernels
from tools.kernels import environments, wheel

ROOT = Path(__file__).parents[2]
MOST_CPU_S = 1.0  # of a first episode, imports apart
HERE = pytest.mark.skipif(
    not runs_here() or sys.platform != "linux", reason=f"kernels are shipped for {PROCESSOR} under Linux and Windows"
)
PLAY = """
import json, sys, time
import gymnasium, cps_envs
from cps_envs.core.compute import compiling
env = gymnasium.make(sys.argv[1])
env.action_space.seed(0)
before = time.process_time()
env.reset(seed=0)
while not any(env.step(env.action_space.sample())[2:4]):
    pass
spent = time.process_time() - before
print(json.dumps([cps_envs.__file__, compiling.compiled, len(compiling.loaded), spent]))
"""


def kept(folder: Path) -> Path:
    """A folder of two files, as the builder finds them."""
    inside = folder / "kernels" / "cps_envs.fdi"
    inside.mkdir(parents=True)
    (inside / "dynamics.step-15.py311.nbi").write_bytes(b"index")
    (inside / "dynamics.step-15.py311.1.nbc").write_bytes(b"code")
    return folder / "kernels"


@HERE
def test_the_wheel_is_pinned_to_what_compiled_it(tmp_path: Path) -> None:
    archive = ZipFile(path := wheel(kept(tmp_path), tmp_path))
    own, python = cps_envs.__version__, "{}{}".format(*sys.version_info)
    assert path.name == f"{PACKAGE}-{own}-cp{python}-none-manylinux_2_17_x86_64.whl"
    metadata = archive.read(f"{PACKAGE}-{own}.dist-info/METADATA").decode().splitlines()
    assert {f"Requires-Dist: cps-envs=={own}", f"Requires-Dist: numba=={numba.__version__}"} <= set(metadata)
    assert archive.read(f"{PACKAGE}/cps_envs.fdi/dynamics.step-15.py311.1.nbc") == b"code"
    record = archive.read(f"{PACKAGE}-{own}.dist-info/RECORD").decode().splitlines()
    assert {line.split(",")[0] for line in record} == set(archive.namelist())


def test_another_machine_is_refused_with_a_remedy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(kernels.platform, "machine", lambda: "arm64")
    with pytest.raises(SystemExit, match="run `cps-envs warm`"):
        wheel(tmp_path, tmp_path)


def test_there_are_eight_environments() -> None:
    assert len(set(environments())) == 8


def run(arguments: list[str], folder: Path, **told: str) -> str:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA_", "PYTHONPATH"))}
    environment |= {"CPS_ENVS_QUIET": "1", **told}
    done = subprocess.run(arguments, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@HERE
@pytest.mark.slow
def test_a_fresh_environment_in_another_folder_compiles_nothing(tmp_path: Path) -> None:
    """Both wheels, no kernel kept from before: first episodes of the eight environments."""
    builders = pytest.importorskip("hatchling.builders.wheel", reason="needs hatchling, which builds the wheel")
    (library,) = builders.WheelBuilder(str(ROOT)).build(directory=str(tmp_path / "dist"))
    shipped = run([sys.executable, "-m", "tools.kernels", "--quick", str(tmp_path / "dist")], ROOT).split()[-1]
    venv.create(tmp_path / "fresh", with_pip=True)
    python = tmp_path / "fresh" / "bin" / "python"
    (site,) = (tmp_path / "fresh" / "lib").glob("python*/site-packages")
    (site / "others.pth").write_text(f"{Path(numba.__file__).parents[1]}\n")  # what we depend on
    run([str(python), "-m", "pip", "install", "--no-deps", "--no-index", library, shipped], tmp_path)
    for env_id in environments():
        name = env_id.partition(":")[2]
        home = {"HOME": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "kept")}
        where, compiled, loaded, spent = json.loads(run([str(python), "-c", PLAY, name], tmp_path, **home))
        assert Path(where).is_relative_to(site)
        assert compiled == []
        assert loaded > 5
        assert spent <= MOST_CPU_S, (name, spent)


@HERE
@pytest.mark.slow
def test_golden_values_hold_for_the_processor_that_kernels_are_shipped_for(tmp_path: Path) -> None:
    told = {"NUMBA_CPU_NAME": PROCESSOR, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path)}
    run([sys.executable, "-m", "pytest", "-q", "-x", "tests/test_golden.py"], ROOT, **told)
