"""The hashed requirements are those of pyproject.toml, at the versions of constraints.txt."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
NAMES = ("light", "all")
HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}")


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
        for needed in re.findall(r'"([\w-]+)', core):
            assert needed in hashed
        assert {"hatchling", "editables"} <= set(hashed)
    assert "torch" in pins(ROOT / "requirements" / "all.txt")
