from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from cps_envs.disbanding.config import INTERPRETATIONS
from cps_paper.claims import CELLS, CLAIMS, ClaimTally, tally
from cps_paper.commands import readings
from cps_paper.commands.chapters import COMMANDS
from cps_paper.commands.summary import END, START, tables
from cps_paper.evidence import Report
from cps_paper.exhibit import ExhibitTable, places
from cps_paper.fdi.experiments import SETS
from cps_paper.hvac.controllers import CONTROLLERS
from cps_paper.testbed.cases import DAMPING
from tests.agents import command_line

ROOT = Path(__file__).parents[2]


@dataclass
class Chapter:
    """Stands in for a chapter that takes minutes."""

    reading: readings.ChapterReading
    passed: bool = True

    def tallies(self) -> Sequence[ClaimTally]:
        verdict = "reproduced" if self.reading.choice == "S0" else "partly"
        return [tally(self.reading.name, CLAIMS, [("P01", verdict), ("P02", "near")]), tally("", CELLS, [])]

    def rechecks(self) -> list[dict[str, Any]]:
        if not self.reading.recheck:
            return []
        return [{"reading": self.reading.name, "condition": "at half", "judged": 2, "changed": {"P02": "partly"}}]

    def tables(self) -> Sequence[ExhibitTable]:
        return [ExhibitTable("A table", places("name", "verdict"), [("first", "near")])]

    def closing(self) -> Sequence[str]:
        return ["Not reproduced: nothing."]

    def document(self) -> dict[str, Any]:
        return {"chapter": self.reading.chapter, "quick": self.reading.quick}

    def figures(self) -> Iterator[tuple[str, Any]]:
        return iter(())


@dataclass
class Chapters:
    """Computes chapters, and remembers which."""

    computed: list[str] = field(default_factory=list)
    failing: str = ""
    stops_at: str = ""

    def __call__(self, reading: readings.ChapterReading, jobs: int, report: Report) -> Chapter:
        if reading.name == self.stops_at:
            raise KeyboardInterrupt
        self.computed.append(reading.name)
        report(1.0, "done")
        return Chapter(reading, passed=reading.name != self.failing)


@pytest.fixture
def chapters(monkeypatch: pytest.MonkeyPatch) -> Chapters:
    found = Chapters()
    monkeypatch.setattr(readings.ChapterReading, "compute", lambda reading, jobs, report: found(reading, jobs, report))
    return found


def invoke(folder: Path, *arguments: str) -> Any:
    return command_line.invoke("reproduce", "all", "--out", str(folder), *arguments, columns=120)


def test_every_chapter_is_computed_under_every_reading(tmp_path: Path, chapters: Chapters) -> None:
    result = invoke(tmp_path)
    assert result.exit_code == 0, result.output
    assert chapters.computed == [each.name for each in readings.readings(quick=False, recheck=False)]
    assert {each.partition("-")[0] for each in chapters.computed} == {"ch2", "testbed", "ch3", "ch4", "ch5"}
    for name in chapters.computed:
        assert "A table" in (tmp_path / f"{name}.txt").read_text(encoding="utf-8")
        assert json.loads((tmp_path / f"{name}.json").read_text(encoding="utf-8"))["quick"] is False
        assert name in result.stdout


def test_claims_that_depend_on_the_reading_are_named(tmp_path: Path, chapters: Chapters) -> None:
    shown = " ".join(invoke(tmp_path).stdout.split())
    assert "ch2-S0: reproduced; ch2-S1: partly; ch2-S2: partly" in shown
    assert shown.count("P02") == 0  # the same everywhere


def test_finished_readings_are_not_computed_again(tmp_path: Path, chapters: Chapters) -> None:
    chapters.stops_at = "ch4-clip"
    assert invoke(tmp_path).exit_code != 0
    before = list(chapters.computed)
    assert before[-1] == "ch3-B"
    chapters.computed, chapters.stops_at = [], ""
    result = invoke(tmp_path, "--json")
    assert chapters.computed == ["ch4-clip", "ch4-qp", "ch5"]
    assert "ch2-S0 was finished already" in result.stderr
    assert [each["reading"] for each in json.loads(result.stdout)] == [*before, "ch4-clip", "ch4-qp", "ch5"]
    assert invoke(tmp_path, "--fresh").exit_code == 0
    assert chapters.computed[3:] == [*before, "ch4-clip", "ch4-qp", "ch5"]


def test_quick_work_is_not_taken_for_the_whole(tmp_path: Path, chapters: Chapters) -> None:
    invoke(tmp_path, "--quick")
    count = len(chapters.computed)
    invoke(tmp_path)
    assert len(chapters.computed) == 2 * count
    assert invoke(tmp_path, "--quick", "--publish").exit_code != 0


def test_single_readings_can_be_asked_for(tmp_path: Path, chapters: Chapters) -> None:
    assert invoke(tmp_path, "--reading", "ch5", "--reading", "ch2-S1").exit_code == 0
    assert chapters.computed == ["ch2-S1", "ch5"]
    unknown = command_line.refusal("reproduce", "all", "--out", str(tmp_path), "--reading", "ch2-S4")
    assert "no reading 'ch2-S4'. Did you mean 'ch2-S" in unknown


def test_leaving_the_reference_gives_exit_code_1(tmp_path: Path, chapters: Chapters) -> None:
    chapters.failing = "ch5"
    result = invoke(tmp_path)
    assert result.exit_code == 1
    assert "left their reference: ch5" in result.stderr


def test_publishing_renews_the_tables_only(tmp_path: Path, chapters: Chapters, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert invoke(tmp_path / "out", "--publish").exit_code != 0  # no page to write to
    page = tmp_path / "docs" / "reproduction.md"
    page.parent.mkdir()
    page.write_text(f"before\n{START}\nold\n{END}\nafter\n", encoding="utf-8")
    assert invoke(tmp_path / "out", "--publish").exit_code == 0
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    assert "| 2 | ch2-S0 | claims | 1 | 1 | - | - | - | - |" in text


def test_a_single_reading_is_renewed_among_the_published_ones(
    tmp_path: Path, chapters: Chapters, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page, data = tmp_path / "docs" / "reproduction.md", tmp_path / "docs" / "reproduction.json"
    page.parent.mkdir()
    page.write_text(f"{START}\n{END}\n", encoding="utf-8")
    assert invoke(tmp_path / "out", "--publish").exit_code == 0
    before = json.loads(data.read_text(encoding="utf-8"))
    changed = [{**each, "wall_s": -1.0} for each in before]
    data.write_text(json.dumps(changed), encoding="utf-8")
    assert invoke(tmp_path / "other", "--reading", "ch5", "--publish").exit_code == 0
    after = json.loads(data.read_text(encoding="utf-8"))
    assert [each["reading"] for each in after] == [each["reading"] for each in before]
    assert [each["wall_s"] >= 0.0 for each in after] == [each["reading"] == "ch5" for each in before]


def test_no_table_is_published_without_the_rechecks_that_it_had(
    tmp_path: Path, chapters: Chapters, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page = tmp_path / "docs" / "reproduction.md"
    page.parent.mkdir()
    page.write_text(f"{START}\n{END}\n", encoding="utf-8")
    assert invoke(tmp_path / "out", "--reading", "ch5", "--publish", "--recheck").exit_code == 0
    assert "| 5 | ch5 | at half | 1 of 2 | P02 partly |" in page.read_text(encoding="utf-8")
    chapters.computed = []
    refused = command_line.refusal("reproduce", "all", "--out", str(tmp_path / "new"), "--reading", "ch5", "--publish")
    assert "ch5 are published as judged again" in refused
    assert "add --recheck" in refused
    assert chapters.computed == []
    assert invoke(tmp_path / "out", "--reading", "ch4-qp", "--publish").exit_code == 0  # had none


def test_the_published_tables_are_those_of_the_published_data() -> None:
    kept = json.loads((ROOT / "docs" / "reproduction.json").read_text(encoding="utf-8"))
    assert [each["reading"] for each in kept] == [each.name for each in readings.readings(quick=False, recheck=False)]
    page = (ROOT / "docs" / "reproduction.md").read_text(encoding="utf-8")
    assert tables(kept) in page


def test_a_tally_counts_words_for_cells_as_words_for_claims() -> None:
    found = tally("S0", CELLS, [("a", "match"), ("b", "miss"), ("c", "near"), ("d", "rough"), ("e", "far")])
    assert found.counts == {"reproduced": 1, "near": 1, "partly": 1, "not reproduced": 2}
    with pytest.raises(ValueError, match="two statements are called 'a'"):
        tally("S0", CELLS, [("a", "match"), ("a", "miss")])


def test_what_all_varies_is_what_the_chapters_know() -> None:
    known = {
        "interpretation": set(INTERPRETATIONS),
        "preset_set": set(SETS),
        "controller": set(CONTROLLERS),
        "damping": set(DAMPING),
    }
    for command in COMMANDS:
        assert set(command.values) <= known.get(command.varied, set())
        evidence = command.load().evidence(**{each.name: each.default for each in command.options})
        assert evidence.results == {}
