from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from cps_agents import docs
from cps_envs import PROBLEMS


def test_the_generated_page_is_current(capsys: pytest.CaptureFixture[str]) -> None:
    assert docs.main(["--check"]) == 0, capsys.readouterr().err


def test_an_old_page_is_found_and_written_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = ["--to", str(tmp_path)]
    assert docs.main(["--check", *folder]) == 1
    assert "make pages" in capsys.readouterr().err
    assert docs.main(folder) == 0
    assert docs.main(["--check", *folder]) == 0


def test_a_role_has_a_page_with_everything_that_there_is_to_know() -> None:
    page = docs.pages()["environments/DisbandingAttack.md"]
    for heading in ("Story", "Threat Model", "Action Space", "Observation Space", "Presets", "Baselines", "References"):
        assert f"\n## {heading}\n" in page
    for heading in ("Best Known Results", "Code to Start", "Rewards", "Version History"):
        assert f"\n## {heading}\n" in page
    assert "{" not in page.partition("## Arguments")[0].replace("{table}", "")
    assert "| 0-9 | `mean_speed` |" in page
    assert "`vehicle_0` to `vehicle_99`" in docs.pages()["environments/disbanding.md"]


def test_pictures_of_the_pages_are_there_and_small() -> None:
    for problem in PROBLEMS:
        film = docs.FOLDER / "images" / f"{problem}.gif"
        assert 10_000 < film.stat().st_size < 2_000_000
        root = ElementTree.fromstring(docs.pages()[f"images/{problem}-loop.svg"])
        assert root.attrib["aria-label"]


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("myst_nb", reason="needs sphinx and myst-nb, which build the site")
    pytest.importorskip("furo", reason="needs furo, the style of the site")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        "-b",
        "html",
        str(docs.FOLDER),
        str(tmp_path),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert (tmp_path / "environments" / "RogueDefense.html").is_file()
