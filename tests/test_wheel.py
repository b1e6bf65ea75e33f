"""What `pip install cps-envs` puts on a machine."""

from __future__ import annotations

import configparser
from pathlib import Path
from zipfile import ZipFile

import pytest

builders = pytest.importorskip("hatchling.builders.wheel", reason="needs hatchling, which builds the wheel")
ROOT = Path(__file__).parents[1]
PACKAGES = {"cps_envs", "cps_agents", "cps_baselines"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> ZipFile:
    """The wheel of this source tree."""
    (built,) = builders.WheelBuilder(str(ROOT)).build(directory=str(tmp_path_factory.mktemp("wheel")))
    return ZipFile(built)


def test_the_wheel_installs_three_packages_of_our_own_name_and_nothing_else(wheel: ZipFile) -> None:
    names = {name.partition("/")[0] for name in wheel.namelist()}
    assert {name for name in names if not name.endswith(".dist-info")} == PACKAGES


def test_everything_that_is_read_at_run_time_is_shipped(wheel: ZipFile) -> None:
    shipped = {name for name in wheel.namelist() if name.partition("/")[0] in PACKAGES}
    folders = (ROOT, ROOT / "agents", ROOT / "baselines")
    for folder in folders:
        for package in PACKAGES:
            for suffix in (".py", ".json", ".csv", ".safetensors", ".typed", ".html", ".css", ".js"):
                found = {file.relative_to(folder).as_posix() for file in (folder / package).rglob(f"*{suffix}")}
                assert {name for name in found if "/." not in name} <= shipped
    assert {Path(name).suffix for name in shipped}.isdisjoint({".nbi", ".nbc", ".pyc"})


def test_entry_points_name_modules_of_the_wheel(wheel: ZipFile) -> None:
    (file,) = [name for name in wheel.namelist() if name.endswith("/entry_points.txt")]
    entries = configparser.ConfigParser(delimiters=("=",))
    entries.read_string(wheel.read(file).decode())
    modules = {target.partition(":")[0] for section in entries.sections() for target in entries[section].values()}
    modules = {module.replace(".", "/") for module in modules}
    assert len(modules) > 20
    for module in modules:
        assert {f"{module}.py", f"{module}/__init__.py"} & set(wheel.namelist()), module
