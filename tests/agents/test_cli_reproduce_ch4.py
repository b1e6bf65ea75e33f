from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from cps_agents.cli import app
from cps_baselines.hvac.reproduction import measures
from cps_baselines.reproduction.regression import Reference
from cps_baselines.reproduction.verdicts import ABSOLUTE, Tolerance


def invoke(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["reproduce", "ch4", "--jobs", "1", *arguments], env={"COLUMNS": "130"})


def test_parts_are_printed_with_a_closing() -> None:
    result = invoke("--table", "4.3fig", "--table", "4.5fig")
    assert result.exit_code == 0
    text = " ".join(result.stdout.split())
    for words in (
        "Fig. 4.3: zone 1 with three input energies",
        "25 % (1 %)",
        "Fig. 4.5: the observer with few sensors",
        "0.44 (0.34-0.60)",
        "paper 0.421",
        "Not reproducible: an input that settles at 1 % of E",
        "The weight R was chosen so that C12 comes out",
    ):
        assert words in text
    assert "Fig. 4.2" not in text
    assert "chapter 4: 100/100" in result.stderr


def test_json_is_all_that_stdout_gets() -> None:
    result = invoke("--table", "4.2fig", "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert (document["chapter"], list(document["parts"]), document["files"]) == (4, ["4.2fig"], [])
    assert document["regression"]["passed"]
    assert document["command"].startswith("cps-envs")
    assert document["wall_s"] > 0


def test_leaving_the_reference_gives_exit_code_1(monkeypatch: pytest.MonkeyPatch) -> None:
    moved = {key: Reference(0.0, Tolerance(0.01, ABSOLUTE)) for key in measures.references()}
    monkeypatch.setattr(measures, "references", lambda: moved)
    result = invoke("--table", "4.2fig")
    assert result.exit_code == 1
    assert "FAILED: clear day: zone 1 before noon" in " ".join(result.stdout.split())


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (("--table", "4.9"), "4.8fig"),
        (("--table", "4.1", "--recheck"), "add --table claims"),
        (("--table", "4.7"), "4.7fig"),
        (("--controller", "pq"), "Known: clip, qp, levels"),
        (("--jobs", "0"), "greater than or equal to 1"),
    ],
)
def test_wrong_input_names_the_remedy(arguments: Sequence[str], remedy: str) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert remedy in " ".join(result.stderr.split())
    assert "Traceback" not in result.stderr


def test_figures_are_written(tmp_path: Path) -> None:
    matplotlib_image = pytest.importorskip("matplotlib.image")
    folder = tmp_path / "new" / "plots"
    result = invoke("--table", "4.2fig", "--table", "4.3fig", "--plot", str(folder))
    assert result.exit_code == 0
    assert sorted(path.name for path in folder.iterdir()) == ["figure_4_2.png", "figure_4_3.png"]
    for path in folder.iterdir():
        picture = matplotlib_image.imread(path)
        assert min(picture.shape[:2]) > 800
        assert picture.std() > 0.02


def test_missing_matplotlib_is_told_before_anything_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    result = invoke("--plot", str(tmp_path))
    assert result.exit_code == 2
    assert 'pip install "cps-envs[baselines]"' in " ".join(result.stderr.split())
    assert "chapter 4" not in result.stderr


@pytest.mark.slow
def test_quick_leaves_out_what_it_says() -> None:
    result = invoke("--quick", "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert {"4.2", "4.8fig", "early"}.isdisjoint(document["parts"])
    left_out = {row["id"] for row in document["parts"]["claims"] if row["verdict"] == "not evaluated"}
    assert left_out == {"C27", "C28", "C38", "C39", "C40", "C41", "C42"}
    assert any("--quick left out" in paragraph for paragraph in document["closing"])
