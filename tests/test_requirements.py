"""What `pip install` puts on a machine: the hashed requirements of pyproject.toml, and the wheel."""

from __future__ import annotations

import configparser
import re
from pathlib import Path
from zipfile import ZipFile

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
NAMES = ("light", "all")
HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}")
CONTENTS = {  # folders of the wheel; what is not here belongs to `paper/` or to `tools/`
    "cps_envs": "core data disbanding fdi hvac rogue",
    "cps_baselines": "disbanding fdi hvac rogue",
    "cps_agents": "arena commands league learning recipes report scoring zoo",
}


def pins(path: Path) -> dict[str, str]:
    """The versions by name that hold for this Python and system."""
    lines = re.sub(r"\\\n", " ", path.read_text(encoding="utf-8")).splitlines()
    wanted = [line.split("--hash")[0].strip() for line in lines if line and not line.startswith("#")]
    found = [Requirement(line) for line in wanted]
    here = [each for each in found if each.marker is None or each.marker.evaluate()]
    assert len({each.name for each in here}) == len(here)
    return {each.name: str(each.specifier) for each in here}


@pytest.mark.parametrize("name", NAMES)
def test_every_file_is_known_by_its_hash(name: str) -> None:
    text = re.sub(r"\\\n", " ", (ROOT / "requirements" / f"{name}.txt").read_text(encoding="utf-8"))
    for line in filter(None, text.splitlines()):
        assert line.startswith("#") or HASH.search(line), line


@pytest.mark.parametrize("name", NAMES)
def test_versions_are_those_that_ci_tests(name: str) -> None:
    tested, hashed = pins(ROOT / "constraints.txt"), pins(ROOT / "requirements" / f"{name}.txt")
    different = {
        each: (hashed[each], tested[each]) for each in hashed if tested.get(each, hashed[each]) != hashed[each]
    }
    assert not different, f"renew requirements/{name}.txt: its first lines say how"


def test_what_the_package_needs_is_there() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    core = text.split("dependencies = [", 1)[1].split("\n]", 1)[0]
    for name in NAMES:
        hashed = pins(ROOT / "requirements" / f"{name}.txt")
        for needed in map(Requirement, re.findall(r'"([^"]+)",', core)):
            assert needed.name in hashed or not (needed.marker is None or needed.marker.evaluate())
        assert {"hatchling", "editables"} <= set(hashed)
    assert "torch" in pins(ROOT / "requirements" / "all.txt")


def test_the_extra_for_clusters_brings_what_submits_jobs() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    (extra,) = map(Requirement, re.findall(r'^ray = \["([^"]+)"\]', text, re.M))
    assert (extra.name, extra.extras) == ("ray", {"default"})
    assert extra.specifier.contains(pins(ROOT / "constraints.txt")["ray"].removeprefix("=="))


def built(source: Path, folder: Path) -> ZipFile:
    """The wheel of a source tree."""
    builders = pytest.importorskip("hatchling.builders.wheel", reason="needs hatchling, which builds the wheel")
    (wheel,) = builders.WheelBuilder(str(source)).build(directory=str(folder))
    return ZipFile(wheel)


def packages(wheel: ZipFile) -> set[str]:
    """What the wheel installs."""
    return {first for name in wheel.namelist() if not (first := name.partition("/")[0]).endswith(".dist-info")}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> ZipFile:
    """The wheel of this source tree."""
    return built(ROOT, tmp_path_factory.mktemp("wheel"))


def test_the_wheel_installs_three_packages_of_our_own_name_and_nothing_else(wheel: ZipFile) -> None:
    assert packages(wheel) == set(CONTENTS)


def test_the_wheel_holds_these_folders_and_no_others(wheel: ZipFile) -> None:
    for package, folders in CONTENTS.items():
        inside = [name.split("/") for name in wheel.namelist() if name.startswith(f"{package}/")]
        assert {parts[1] for parts in inside if len(parts) > 2} == set(folders.split()), package


def test_the_paper_is_a_wheel_of_its_own_and_of_the_same_version(wheel: ZipFile, tmp_path: Path) -> None:
    paper = built(ROOT / "paper", tmp_path)
    assert packages(paper) == {"cps_paper"}
    shipped = {name for name in paper.namelist() if name.startswith("cps_paper/")}
    found = {path.relative_to(ROOT / "paper").as_posix() for path in (ROOT / "paper" / "cps_paper").rglob("*.csv")}
    assert found
    assert found <= shipped
    (version,) = {name.split("-")[1].partition(".dist")[0] for name in wheel.namelist() if ".dist-info/" in name}
    (own,) = {name.split("-")[1].partition(".dist")[0] for name in paper.namelist() if ".dist-info/" in name}
    assert own == version
    for project in (ROOT / "pyproject.toml", ROOT / "paper" / "pyproject.toml"):
        pinned = re.findall(r'"cps-(?:paper|envs\[cli,baselines\])==([^"]+)"', project.read_text(encoding="utf-8"))
        assert pinned == [version]


def test_the_readme_of_the_wheel_has_links_that_lead_somewhere_without_the_repository(wheel: ZipFile) -> None:
    (metadata,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    text = wheel.read(metadata).decode()
    assert "# cps_envs" in text
    links = re.findall(r"\]\(([^)]+)\)", text)
    assert len(links) > 10
    assert [link for link in links if not link.startswith(("https://", "#"))] == []


def test_everything_that_is_read_at_run_time_is_shipped(wheel: ZipFile) -> None:
    shipped = {name for name in wheel.namelist() if name.partition("/")[0] in CONTENTS}
    folders = (ROOT, ROOT / "agents", ROOT / "baselines")
    for folder in folders:
        for package in CONTENTS:
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
