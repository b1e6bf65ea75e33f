"""`python -m tools.coverage`: a quick slice with fixed seeds, and what it writes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cps_agents.arena.statistics import Estimate
from tests.agents.command_line import refusal, succeeded
from tools.command import program
from tools.coverage.__main__ import coverage
from tools.coverage.cases import Case, Outcome, all_cases
from tools.coverage.simulation import Effort, simulate

ROOT = Path(__file__).parents[2]
REPETITIONS = 200
SLICE = {  # title: the least and the greatest share of the intervals
    "trained 5 seeds v trained 5, 50 episodes, seeds differ much": (0.92, 0.99),  # .87 without the baseline's seeds
    "10 x 4 equal policies, 10 episodes": (0.92, 1.0),  # .30 where strategies are valued on what chose them
    "5 seeds x 50 episodes": (0.90, 0.98),
    "trained 5 seeds v trained 1, 50 episodes": (0.0, 0.85),  # why one training seed is marked
    "5 x 50, one training seed in five fails": (0.6, 0.8),  # why tables have the worst seed
}


def test_a_slice_holds_the_truth_as_often_as_it_says() -> None:
    cases = [case for case in all_cases() if case.title in SLICE]
    assert len(cases) == len(SLICE)
    for found in simulate(cases, Effort(REPETITIONS, 300)):
        least, greatest = SLICE[found.title]
        assert least <= found.share <= greatest, (found.title, found.share)


def known(generator: np.random.Generator, resamples: int) -> Outcome:
    """Every fourth interval lies above the truth, every eighth below."""
    place = int(generator.integers(8))
    shift = 2.0 if place < 2 else -2.0 if place == 2 else 0.0
    return Outcome(Estimate(5.0 + shift, 4.0 + shift, 6.0 + shift, 1, 1), 5.0)


def test_intervals_are_counted_by_side() -> None:
    (found,) = simulate([Case("group", "title", known)], Effort(250, 1))
    assert (found.repetitions, found.held + found.above + found.below) == (250, 250)
    assert found.above / 250 == pytest.approx(1 / 4, abs=0.08)
    assert found.below / 250 == pytest.approx(1 / 8, abs=0.06)
    assert found.length == 2.0
    assert found.bias == pytest.approx(2.0 * (found.above - found.below) / 250)
    assert simulate([Case("group", "title", known)], Effort(250, 1))[0].held == found.held


def test_every_case_has_its_own_name_and_is_published() -> None:
    titles = [case.title for case in all_cases()]
    assert len(set(titles)) == len(titles)
    page = (ROOT / "docs" / "coverage.md").read_text(encoding="utf-8")
    assert all(f"| {title} |" in page for title in titles), "run `python -m tools.coverage --publish`"


def test_the_command_writes_and_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    few = [Case("a group", "a title", known, "a note")]
    monkeypatch.setattr("tools.coverage.__main__.all_cases", lambda: few)
    monkeypatch.chdir(tmp_path)
    command, tool = ["--jobs", "1", "--out", "out"], program(coverage)
    result = succeeded(*command, "--quick", program=tool)
    assert "a title: a note." in result.stdout
    assert all(text in result.stdout for text in ("holds the truth", "length", "2.000"))
    assert "no results" in result.stderr
    for wrong, message in ((["--quick", "--publish"], "leave out --publish"), (["--publish"], "no folder docs")):
        assert message in refusal(*command, *wrong, program=tool)
    (tmp_path / "docs").mkdir()
    result = succeeded(*command, "--publish", "--json", program=tool)
    (case,) = json.loads(result.stdout)["cases"]
    assert case["share"] == case["held"] / case["repetitions"]
    page = (tmp_path / "docs" / "coverage.md").read_text(encoding="utf-8")
    assert page == (tmp_path / "out" / "coverage.md").read_text(encoding="utf-8")
    for text in ("## A group", "| a title |", "`python -m tools.coverage", "commit", "1,000 repetitions"):
        assert text in page
