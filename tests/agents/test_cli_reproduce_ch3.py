from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from cps_agents.cli import app
from cps_baselines.fdi.reproduction import counts


def invoke(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["reproduce", "ch3", "--jobs", "1", *arguments], env={"COLUMNS": "110"})


def test_table_is_printed_with_counts_controls_and_a_closing() -> None:
    result = invoke("--table", "3.1", "--quick")
    assert result.exit_code == 0
    text = " ".join(result.stdout.split())
    for words in (
        "Table 3.1: n = 4, set A, m = 14, highs, 2 s per solve",
        "1-2 -1.995",
        "16 (16)",
        "Control rules",
        "Not reproducible: the individual speeds",
        "Not reproducible: the constants",
        "no count is more than 3 below its goal",
    ):
        assert words in text
    assert "Table 3.2" not in text
    assert "chapter 3: 100/100" in result.stderr


def test_set_and_acceptance_are_used() -> None:
    result = invoke("--table", "3.1", "--quick", "--preset-set", "B", "--acceptance", "0.25", "--time-limit", "1")
    assert result.exit_code == 0
    text = " ".join(result.stdout.split())
    assert "Table 3.1: n = 4, set B, m = 15, highs, 1 s per solve" in text
    assert "the counts are not judged" in text


def test_audit_alone() -> None:
    result = invoke("--audit")
    assert result.exit_code == 0
    text = " ".join(result.stdout.split())
    assert "75 of 133 comparisons contradict one another" in text
    assert "27 of 66 printed speeds lie beyond the relaxation" in text
    assert "Table 3.1:" not in text


def test_json_is_all_that_stdout_gets() -> None:
    result = invoke("--table", "fig", "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert list(document["parts"]) == ["fig"]
    assert document["chapter"] == 3
    assert document["command"].startswith("cps-envs")
    assert document["wall_s"] > 0


def test_counts_below_their_goals_give_exit_code_1(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(counts.GOALS["A"], "3.1", counts.Counts(20, 9, 9, 9))  # type: ignore[index]
    result = invoke("--table", "3.1", "--quick")
    assert result.exit_code == 1
    assert "FAILED: 3.1" in " ".join(result.stdout.split())


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (("--table", "3.9"), "3.7"),
        (("--preset-set", "C"), "A, B"),
        (("--back-end", "gurobi"), "highs"),
        (("--time-limit", "0"), "above 0"),
        (("--jobs", "0"), "greater than or equal to 1"),
    ],
)
def test_wrong_input_names_the_remedy(arguments: Sequence[str], remedy: str) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert remedy in " ".join(result.stderr.split())
    assert "Traceback" not in result.stderr


def test_missing_solver_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyscipopt", None)
    result = invoke("--table", "3.1", "--quick", "--back-end", "scip")
    assert result.exit_code == 2
    assert "pip install" in " ".join(result.stderr.split())


def test_figure_is_written(tmp_path: Path) -> None:
    matplotlib_image = pytest.importorskip("matplotlib.image")
    folder = tmp_path / "new" / "plots"
    result = invoke("--table", "fig", "--table", "audit", "--plot", str(folder))
    assert result.exit_code == 0
    assert [path.name for path in folder.iterdir()] == ["figure_3_2.png"]
    picture = matplotlib_image.imread(folder / "figure_3_2.png")
    assert min(picture.shape[:2]) > 800
    assert picture.std() > 0.02


def test_help_says_that_no_table_is_reproduced() -> None:
    result = CliRunner().invoke(app, ["reproduce", "ch3", "--help"], env={"COLUMNS": "110"})
    assert "No table is reproduced as a whole" in " ".join(result.stdout.split())
