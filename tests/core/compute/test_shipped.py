"""Kernels that come compiled: taken if their sources and this processor fit, and unless native ones are wanted."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cps_envs.core.compute import shipped
from cps_envs.core.compute.shipped import NATIVE, PACKAGE, PROCESSOR, folder_for, key_for, package_of

MODULE = """
from cps_envs.core.compute.kernels import kernel

@kernel
def run(x: float) -> float:
    return {factor} * x
"""
CALL = "from strange.physics import run; print(run(3.0), sum(run.stats.cache_misses.values()))"


def outcome(folder: Path, **environment: str) -> list[str]:
    """What the kernel returns in a process of its own, and whether it was compiled; nothing is kept from before."""
    kept = folder / "kept"
    shutil.rmtree(kept, ignore_errors=True)
    told = {"NUMBA_CACHE_DIR": str(kept), "CPS_ENVS_QUIET": "1", "PYTHONPATH": str(folder), **environment}
    child = [sys.executable, "-c", environment.get("CALL", CALL)]
    around = {name: value for name, value in os.environ.items() if name != NATIVE}  # which `cps-envs warm` sets
    return subprocess.run(
        child, cwd=folder, env=around | told, capture_output=True, text=True, check=True
    ).stdout.split()


@pytest.mark.skipif(not shipped.runs_here(), reason=f"this processor does not know {PROCESSOR}")
def test_a_shipped_kernel_is_taken_if_it_is_of_these_sources_and_wanted(tmp_path: Path) -> None:
    package = tmp_path / "strange"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "physics.py").write_text(MODULE.format(factor=2.0))
    assert outcome(tmp_path, NUMBA_CPU_NAME=PROCESSOR, NUMBA_CPU_FEATURES="") == ["6.0", "1"]
    folder = tmp_path / PACKAGE / "strange"
    folder.mkdir(parents=True)
    for path in tmp_path.rglob("kept/*/*.nb?"):
        shutil.move(path, folder / path.name)
    assert len(list(folder.iterdir())) == 2
    assert outcome(tmp_path) == ["6.0", "0"]
    assert outcome(tmp_path, **{NATIVE: "1"}) == ["6.0", "1"]
    other = "from cps_envs.core.compute import shipped; shipped.runs_here = lambda: False; "
    assert outcome(tmp_path, CALL=other + CALL) == ["6.0", "1"]
    (package / "physics.py").write_text(MODULE.format(factor=5.0))
    assert outcome(tmp_path) == ["15.0", "1"]


def test_it_is_filed_under_the_processor_that_it_was_compiled_for() -> None:
    assert key_for(("signature", ("triple", "host", "+avx512f"), "code")) == (
        "signature",
        ("triple", PROCESSOR, ""),
        "code",
    )


def test_without_the_distribution_there_is_no_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv(NATIVE, raising=False)
    monkeypatch.setattr(shipped, "installed", lambda: None)
    assert folder_for("cps_envs.fdi.game") is None
    monkeypatch.setattr(shipped, "installed", lambda: tmp_path)
    assert folder_for("cps_envs.fdi.game") == tmp_path / "cps_envs.fdi"
    monkeypatch.setenv(NATIVE, "1")
    assert folder_for("cps_envs.fdi.game") is None
    assert package_of("alone") == ""


@pytest.mark.parametrize("missing", [*shipped.FEATURES, None])
def test_a_processor_that_lacks_anything_compiles(monkeypatch: pytest.MonkeyPatch, missing: str | None) -> None:
    known = {name: name != missing for name in shipped.FEATURES}
    monkeypatch.setattr(shipped, "get_host_cpu_features", lambda: known)
    assert shipped.runs_here() is (missing is None)
