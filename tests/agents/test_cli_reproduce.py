"""The command of every chapter: what it prints, writes and refuses, and its exit code."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from cps_paper import evidence
from cps_paper.rogue import reference
from cps_paper.rogue.heat_map import COURSE_FREQUENCIES_HZ
from tests.agents.command_line import invoke, succeeded
from tests.turns import in_turn

TESTBED = ("testbed", "--quick", "--seeds", "2")


@pytest.fixture(scope="module", autouse=True)
def experiments_are_run_once() -> Iterator[None]:
    """Several commands ask for the same ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evidence, "_run", cache(evidence._run))
        yield


def reproduce(chapter: str, *arguments: str) -> Any:
    return succeeded("reproduce", chapter, "--jobs", "1", *arguments, columns=130)


PRINTED: Mapping[tuple[str, ...], Sequence[str]] = {
    ("ch2", "--table", "2.2"): ("Table 2.2", "29.57", "29.56", "match", "near", "18 of 18", "tuned on the mpc"),
    ("ch3", "--table", "3.1", "--quick"): (
        "Table 3.1: n = 4, set A, m = 20",
        "1-2 -3.407",
        "any 1.75 m/s",
        "Control rules",
        "Not reproducible: the individual speeds",
        "Not reproducible: the constants",
        "every count is within 3 of its reference",
    ),
    ("ch3", "--table", "3.1", "--quick", "--preset-set", "B", "--acceptance", "0.25", "--nodes", "50"): (
        "Table 3.1: n = 4, set B, m = 20",
        "the counts are not judged",
    ),
    ("ch3", "--audit"): (
        "75 of 133 comparisons contradict one another",
        "27 of 66 printed speeds lie beyond the relaxation",
    ),
    ("ch4", "--table", "4.3fig", "--table", "4.5fig"): (
        "Fig. 4.3: zone 1 with three input energies",
        "25 % (1 %)",
        "Fig. 4.5: the observer with few sensors",
        "0.44 (0.34-0.60)",
        "paper 0.421",
        "Not reproducible: an input that settles at 1 % of E",
        "The weight R was chosen so that C12 comes out",
    ),
    ("ch5", "--part", "5.5"): ("Fig. 5.5", "modified, +2 m", "867", "62.7", "12 of 12", "largest difference"),
    TESTBED: ("30.02", "21.82", "19.73", "in 2 of 2 seeds", "T13", "stand-in", "Regression check"),
}
LEFT_OUT = {
    ("ch3", "--table", "3.1", "--quick"): "Table 3.2",
    ("ch3", "--audit"): "Table 3.1:",
    ("ch4", "--table", "4.3fig", "--table", "4.5fig"): "Fig. 4.2",
}


@pytest.mark.parametrize("arguments", in_turn((pytest.param(each, id=" ".join(each)) for each in PRINTED), 2))
def test_what_is_asked_for_is_printed_with_a_closing(arguments: tuple[str, ...]) -> None:
    result = reproduce(*arguments)
    text = " ".join(result.stdout.split())
    for words in PRINTED[arguments]:
        assert words in text
    assert LEFT_OUT.get(arguments, "nothing of the kind") not in text
    title = "test bed" if arguments == TESTBED else f"chapter {arguments[0][-1]}"
    assert f"{title}: 100/100" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "part", "figure"),
    in_turn(
        [
            (("ch4", "--table", "4.2fig"), "4.2fig", "figure_4_2"),
            (("ch2", "--table", "2.3fig"), "2.3fig", "figure_2_3"),
            (("ch2", "--table", "2.2.1"), "2.2.1", "string_stability"),
            (TESTBED, "", "figure_2_5"),
            (("ch3", "--table", "fig"), "fig", "figure_3_2"),
            (("ch5", "--part", "5.3"), "5.3", "figure_5_3"),
        ],
        3,
    ),
)
def test_one_exhibit_is_json_a_picture_and_sheets(
    arguments: tuple[str, ...], part: str, figure: str, tmp_path: Path
) -> None:
    matplotlib_image = pytest.importorskip("matplotlib.image")
    folder = tmp_path / "new" / "plots"
    result = reproduce(*arguments, "--json", "--plot", str(folder), "--csv", str(tmp_path / "sheets"))
    document = json.loads(result.stdout)  # nothing else on stdout
    assert list(document.get("parts", {""})) == [part]
    assert document["command"].startswith("cps-envs")
    assert document["wall_s"] > 0
    sheets = sorted((tmp_path / "sheets").iterdir())
    assert document["files"][0] == str(folder / f"{figure}.png")
    assert sorted(document["files"][1:]) == list(map(str, sheets))
    for sheet in sheets:
        rows = list(csv.reader(sheet.read_text(encoding="utf-8").splitlines()[:1]))
        assert len(rows[0]) > 1
    picture = matplotlib_image.imread(folder / f"{figure}.png")
    assert min(picture.shape[:2]) > 800
    assert picture.std() > 0.02


def test_the_second_by_second_courses_of_chapter_5() -> None:
    document = json.loads(reproduce("ch5", "--part", "5.3", "--json").stdout)
    assert len(document["parts"]["5.3"]) == 2 * len(COURSE_FREQUENCIES_HZ)
    assert document["parts"]["5.3"][0]["damage"][-1] == pytest.approx(669.7, abs=0.1)
    assert all(each["passed"] for each in document["regression"])


def test_leaving_the_reference_gives_exit_code_1(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = next(each for each in reference.damages() if each.reference.value == 45.144)
    moved = replace(cell, reference=replace(cell.reference, value=50.0))
    monkeypatch.setattr(reference, "damages", lambda: [moved])
    result = invoke("reproduce", "ch5", "--jobs", "1", "--part", "5.5", columns=130)
    assert result.exit_code == 1
    assert "FAILED: sliding mode, pass" in " ".join(result.stdout.split())


def test_a_part_without_a_figure_says_that_nothing_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    result = reproduce("ch3", "--table", "3.1", "--quick", "--plot", str(tmp_path))
    assert "No figure: the parts asked for have none." in result.stderr


def test_help_says_that_no_table_of_chapter_3_is_reproduced() -> None:
    assert "No table is reproduced as a whole" in " ".join(succeeded("reproduce", "ch3", "--help").stdout.split())


@pytest.mark.slow
def test_quick_leaves_out_what_it_says() -> None:
    document = json.loads(reproduce("ch4", "--quick", "--json").stdout)
    assert {"4.2", "4.8fig", "deviation", "early"}.isdisjoint(document["parts"])
    left_out = {row["id"] for row in document["parts"]["claims"] if row["verdict"] == "not evaluated"}
    assert left_out == {"C27", "C28", "C38", "C39", "C40", "C41", "C42", "C47"}
    assert any("--quick left out" in paragraph for paragraph in document["closing"])


@pytest.mark.slow
def test_the_rest_of_chapter_5_is_printed_and_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    result = reproduce("ch5", "--part", "maps", "--part", "claims", "--part", "headroom", "--plot", str(tmp_path))
    text = " ".join(result.stdout.split())
    for words in ("Figs. 5.6 to 5.11", "Collision line", "What the text claims", "solid:", "Head-room", "24 of 24"):
        assert words in text
    names = {"figures_5_6_to_5_11_pass.png", "figures_5_6_to_5_11_solid.png"}
    assert {path.name for path in tmp_path.iterdir()} == names
