from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from cps_agents.cli import app
from cps_baselines.rogue.reproduction import reference
from cps_baselines.rogue.reproduction.settings import COURSE_FREQUENCIES_HZ

matplotlib_image = pytest.importorskip("matplotlib.image")


def invoke(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["reproduce", "ch5", "--jobs", "1", *arguments], env={"COLUMNS": "120"})


def test_a_figure_is_printed_with_the_regression_check() -> None:
    result = invoke("--part", "5.5")
    assert result.exit_code == 0
    for words in ("Fig. 5.5", "modified, +2 m", "867", "62.7", "12 of 12", "largest difference"):
        assert words in " ".join(result.stdout.split())
    assert "chapter 5: 100/100" in result.stderr


def test_json_is_all_that_stdout_gets_and_figures_are_written(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "plots"
    result = invoke("--part", "5.3", "--json", "--plot", str(folder))
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert list(document["parts"]) == ["5.3"]
    assert len(document["parts"]["5.3"]) == 2 * len(COURSE_FREQUENCIES_HZ)
    assert document["parts"]["5.3"][0]["damage"][-1] == pytest.approx(669.7, abs=0.1)
    assert all(each["passed"] for each in document["regression"])
    assert document["files"] == [str(folder / "figure_5_3.png")]
    picture = matplotlib_image.imread(folder / "figure_5_3.png")
    assert min(picture.shape[:2]) > 800
    assert picture.std() > 0.02


def test_leaving_the_reference_gives_exit_code_1(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = next(each for each in reference.damages() if each.reference.value == 45.144)
    moved = replace(cell, reference=replace(cell.reference, value=50.0))
    monkeypatch.setattr(reference, "damages", lambda: [moved])
    result = invoke("--part", "5.5")
    assert result.exit_code == 1
    assert "FAILED" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (("--part", "5.9"), "Known: 5.2, 5.3, 5.4, 5.5, maps"),
        (("--part", "5.3", "--recheck"), "add --part claims"),
        (("--jobs", "0"), "greater than or equal to 1"),
    ],
)
def test_wrong_input_names_the_remedy(arguments: Sequence[str], remedy: str) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert remedy in " ".join(result.stderr.split())
    assert "Traceback" not in result.stderr


@pytest.mark.slow
def test_everything_else_is_printed_and_drawn(tmp_path: Path) -> None:
    result = invoke("--part", "maps", "--part", "claims", "--part", "headroom", "--plot", str(tmp_path))
    assert result.exit_code == 0, result.output
    text = " ".join(result.stdout.split())
    for words in ("Figs. 5.6 to 5.11", "Collision line", "What the text claims", "solid:", "Head-room", "24 of 24"):
        assert words in text
    names = {"figures_5_6_to_5_11_pass.png", "figures_5_6_to_5_11_solid.png"}
    assert {path.name for path in tmp_path.iterdir()} == names
