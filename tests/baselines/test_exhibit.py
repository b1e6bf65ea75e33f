from __future__ import annotations

import json
from dataclasses import dataclass

import pytest

from cps_baselines.reproduction.chapter import Chapter, Reproduction
from cps_baselines.reproduction.evidence import Evidence
from cps_baselines.reproduction.exhibit import Column, Exhibit, Table, places, with_properties
from cps_baselines.reproduction.verdicts import (
    ABSOLUTE,
    MATCH,
    MISS,
    NEAR,
    NOT,
    REPRODUCED,
    Check,
    Reference,
    Tolerance,
    of_cell,
    of_number,
)
from cps_envs.core.errors import ConfigurationError


@dataclass(frozen=True)
class Tank:
    """A record."""

    name: str
    level_m: float | None

    @property
    def full(self) -> bool:
        return self.level_m is not None and self.level_m > 2.0


@dataclass(frozen=True)
class Filling:
    """An experiment that fills a tank."""

    level_m: float
    cost: float = 1.0
    label: str = "filling"

    def run(self) -> float:
        return self.level_m


COLUMNS = (Column("", "name"), Column("level", "level_m", "{:.1f} m"), Column("both", lambda tank: (1, 2), "{}/{}"))
TANKS = (Tank("a", 2.5), Tank("a", None), Tank("b", 1.0))


def test_a_table_has_text_lines_and_sheets() -> None:
    table = Table("Tanks", COLUMNS, TANKS, grouped=1, footer=("paper", "3 m", ""))
    assert table.headings == ["", "level", "both"]
    assert table.rows[:2] == [("a", "2.5 m", "1/2"), ("a", "-", "1/2")]
    assert table.rows[-1] == ("paper", "3 m", "")
    assert table.breaks == [1, 2]
    assert table.csv.splitlines() == [",level,both", "a,2.5 m,1/2", "a,-,1/2", "b,1.0 m,1/2", "paper,3 m,"]
    assert Table("", places("x", "y"), [("1", "2")]).rows == [("1", "2")]


def chapter_of(*exhibits: Exhibit[Evidence]) -> Chapter[Evidence]:
    return Chapter(
        title="chapter 9",
        evidence=Evidence,
        reading=lambda evidence: "as printed",
        exhibits=exhibits,
        closing=lambda found: ["That is all."],
        document=Reproduction.data,
        checks=lambda found: [Check("level", found.evidence[Filling(2.0)], Reference(2.0, Tolerance(0.05)))],
    )


def of_tanks(name: str, *, quick: bool = True, key: str = "") -> Exhibit[Evidence]:
    def tables(evidence: Evidence) -> list[Table]:
        tank = Tank(name, evidence[Filling(2.0)])
        return [Table(name, COLUMNS, [tank], key=key, data=with_properties("full")), Table("text", COLUMNS, [tank])]

    return Exhibit(name, "tanks", lambda evidence: [Filling(2.0)], tables, quick=quick)


def test_everything_follows_from_the_declaration() -> None:
    follows = Exhibit[Evidence](
        "more", "", lambda evidence: (), lambda evidence: [Table("more", COLUMNS, TANKS)], given=lambda seen: True
    )
    chapter = chapter_of(of_tanks("first"), of_tanks("second", quick=False, key="tanks"), follows)
    assert list(chapter.parts) == ["first", "second"]
    assert chapter.chosen(quick=True) == ("first",)
    assert chapter.chosen(["second"], quick=True) == ("second",)
    with pytest.raises(
        ConfigurationError, match=r"chapter 9 has no part 'frist'. Did you mean 'first'.*Known: first, second"
    ):
        chapter.chosen(["frist"])
    found = chapter.reproduce()
    assert found.passed
    assert [table.title for table in found.tables()] == ["first", "text", "second", "text", "more"]
    row = {"name": "first", "level_m": 2.0, "full": False}
    assert json.loads(json.dumps(found.document())) == {
        "first": [row],
        "second": {"tanks": [{**row, "name": "second"}]},
    }
    assert [name for name, _ in found.sheets()] == ["first-1", "first-2", "second-1", "second-2", "more-1"]
    assert found.closing() == ["That is all."]
    assert found.tallies() == []


def test_what_left_the_reference_fails_unless_it_always_was_outside() -> None:
    chapter = chapter_of(of_tanks("first"))
    results = {Filling(2.0): 2.2}
    assert not Reproduction(chapter, ("first",), Evidence(results)).passed
    stated = Reference(1.0, Tolerance(0.1, ABSOLUTE), recorded=2.2, reason="another pump")
    check = Check("level", 2.25, stated)
    assert (check.inside, check.passed, round(check.difference, 2)) == (False, True, 1.25)


@pytest.mark.parametrize(("ours", "word", "cell"), [(2.0, REPRODUCED, MATCH), (4.0, NEAR, NEAR), (4.1, NOT, MISS)])
def test_near_is_twice_the_tolerance(ours: float, word: str, cell: str) -> None:
    assert of_number(ours, 0.0, Tolerance(2.0, ABSOLUTE), Tolerance(0.05)) == word
    assert of_cell(ours, 0.0, Tolerance(2.0, ABSOLUTE)) == cell
