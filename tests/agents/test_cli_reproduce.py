from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cps_agents.cli import app
from cps_agents.commands.string_stability import string_stability
from cps_baselines.disbanding.reproduction import cells

matplotlib_image = pytest.importorskip("matplotlib.image")


def invoke(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["reproduce", "ch2", "--jobs", "1", *arguments], env={"COLUMNS": "100"})


def invoke_stability(*arguments: str) -> Any:
    alone = typer.Typer()
    alone.command()(string_stability)
    return CliRunner().invoke(alone, list(arguments), env={"COLUMNS": "130"})


def test_table_is_printed_with_verdicts_and_a_closing() -> None:
    result = invoke("--table", "2.2")
    assert result.exit_code == 0
    for words in ("Table 2.2", "29.57", "29.56", "match", "near", "Regression check", "18 of 18", "tuned on the mpc"):
        assert words in " ".join(result.stdout.split())
    assert "chapter 2: 100/100" in result.stderr


def test_json_is_all_that_stdout_gets() -> None:
    result = invoke("--table", "2.3fig", "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert list(document["parts"]) == ["2.3fig"]
    assert document["command"].startswith("cps-envs")
    assert document["files"] == []
    assert document["wall_s"] > 0


def test_leaving_the_reference_gives_exit_code_1(monkeypatch: pytest.MonkeyPatch) -> None:
    moved = {key: {**row, "velocity_error_percent": "0.0"} for key, row in cells.references().items()}
    monkeypatch.setattr(cells, "references", lambda: moved)
    result = invoke("--table", "2.2")
    assert result.exit_code == 1
    assert "FAILED" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (("--table", "2.4"), "2.1fig"),
        (("--table", "2.2", "--interpretation", "S9"), "S0, S1, S2"),
        (("--table", "2.2", "--recheck"), "add --table claims"),
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
    folder = tmp_path / "new" / "plots"
    result = invoke("--table", "2.2", "--table", "2.3fig", "--plot", str(folder))
    assert result.exit_code == 0
    assert [path.name for path in folder.iterdir()] == ["figure_2_3.png"]
    assert str(folder) in result.stderr
    picture = matplotlib_image.imread(folder / "figure_2_3.png")
    assert min(picture.shape[:2]) > 800
    assert picture.std() > 0.02


def test_missing_matplotlib_is_told_before_anything_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    result = invoke("--plot", str(tmp_path))
    assert result.exit_code == 2
    assert 'pip install "cps-envs[baselines]"' in " ".join(result.stderr.split())
    assert "chapter 2" not in result.stderr


def test_string_stability_prints_the_table_and_the_verdict(tmp_path: Path) -> None:
    target = tmp_path / "stability.png"
    result = invoke_stability("--plot", str(target))
    assert result.exit_code == 0
    assert "1.688  0.150    42 s" in result.stdout
    assert "contradicts section 2.2.1" in result.stdout
    assert matplotlib_image.imread(target).shape[1] > 1000


def test_string_stability_as_json() -> None:
    document = json.loads(invoke_stability("--json").stdout)
    assert len(document["peaks"]) == 14 * 5
    (peak,) = (row for row in document["peaks"] if (row["vehicles_per_platoon"], row["tau_s"]) == (10, 0.1))
    assert peak["gain"] == pytest.approx(1.69, abs=0.005)
    assert document["stable_sizes"]["0.5"] == []
