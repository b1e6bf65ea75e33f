"""What a reproduction is made of: exhibits, claims, and evidence that is computed once."""

from __future__ import annotations

import json
from dataclasses import dataclass

import pytest

from cps_envs.core.errors import ConfigurationError
from cps_paper.chapter import Chapter, Reproduction
from cps_paper.claims import (
    Claim,
    Claims,
    Finding,
    findings_document,
    findings_summary,
    findings_table,
    joined,
)
from cps_paper.evidence import Evidence, NotRunError, compute
from cps_paper.exhibit import Column, Exhibit, ExhibitTable, places, with_properties
from cps_paper.verdicts import (
    ABSOLUTE,
    BELOW,
    FACTOR,
    MATCH,
    MISS,
    NEAR,
    NOT,
    PARTLY,
    REPRODUCED,
    SHARE,
    UNKNOWN,
    Check,
    Reference,
    Tolerance,
    of_cases,
    of_cell,
    of_comparisons,
    of_number,
)


@dataclass(frozen=True)
class Tank:
    """A record."""

    name: str
    level_m: float | None

    @property
    def full(self) -> bool:
        return self.level_m is not None and self.level_m > 2.0


@dataclass(frozen=True)
class Number:
    """An experiment whose result is a number."""

    value: float
    cost: float = 1.0

    @property
    def label(self) -> str:
        return f"{self.value:g}"

    def run(self) -> float:
        return self.value


COLUMNS = (Column("", "name"), Column("level", "level_m", "{:.1f} m"), Column("both", lambda tank: (1, 2), "{}/{}"))
TANKS = (Tank("a", 2.5), Tank("a", None), Tank("b", 1.0))


def test_a_table_has_text_lines_and_sheets() -> None:
    table = ExhibitTable("Tanks", COLUMNS, TANKS, grouped=1, footer=("paper", "3 m", ""))
    sheet = table.sheet
    assert sheet.columns == ["", "level", "both"]
    assert sheet.rows[:2] == [("a", "2.5 m", "1/2"), ("a", "-", "1/2")]
    assert sheet.rows[-1] == ("paper", "3 m", "")
    assert sheet.breaks == [1, 2]
    assert sheet.csv.splitlines() == [",level,both", "a,2.5 m,1/2", "a,-,1/2", "b,1.0 m,1/2", "paper,3 m,"]
    assert ExhibitTable("", places("x", "y"), [("1", "2")]).sheet.rows == [("1", "2")]


def chapter_of(*exhibits: Exhibit[Evidence]) -> Chapter[Evidence]:
    return Chapter(
        title="chapter 9",
        evidence=Evidence,
        reading=lambda evidence: "as printed",
        exhibits=exhibits,
        closing=lambda found: ["That is all."],
        document=Reproduction.data,
        checks=lambda found: [Check("level", found.evidence[Number(2.0)], Reference(2.0, Tolerance(0.05)))],
    )


def of_tanks(name: str, *, quick: bool = True, key: str = "") -> Exhibit[Evidence]:
    def tables(evidence: Evidence) -> list[ExhibitTable]:
        tank = Tank(name, evidence[Number(2.0)])
        return [
            ExhibitTable(name, COLUMNS, [tank], key=key, data=with_properties("full")),
            ExhibitTable("text", COLUMNS, [tank]),
        ]

    return Exhibit(name, "tanks", lambda evidence: [Number(2.0)], tables, quick=quick)


def test_everything_follows_from_the_declaration() -> None:
    follows = Exhibit[Evidence](
        "more",
        "",
        lambda evidence: (),
        lambda evidence: [ExhibitTable("more", COLUMNS, TANKS)],
        given=lambda seen: True,
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
    results = {Number(2.0): 2.2}
    assert not Reproduction(chapter, ("first",), Evidence(results)).passed
    stated = Reference(1.0, Tolerance(0.1, ABSOLUTE), recorded=2.2, reason="another pump")
    check = Check("level", 2.25, stated)
    assert (check.inside, check.passed, round(check.difference, 2)) == (False, True, 1.25)
    assert not Check("level", 2.0, stated).passed


@pytest.mark.parametrize(("ours", "word", "cell"), [(2.0, REPRODUCED, MATCH), (4.0, NEAR, NEAR), (4.1, NOT, MISS)])
def test_near_is_twice_the_tolerance(ours: float, word: str, cell: str) -> None:
    assert of_number(ours, 0.0, Tolerance(2.0, ABSOLUTE), Tolerance(0.05)) == word
    assert of_cell(ours, 0.0, Tolerance(2.0, ABSOLUTE)) == cell


def made() -> Claims[dict[str, float]]:
    """A check of two claims, one of which was left out."""
    claims: Claims[dict[str, float]] = Claims("claims_ch2")

    @claims.judges("P01", "P02")
    def check(evidence: dict[str, float], claim: Claim) -> Finding:
        if claim.id not in evidence:
            raise NotRunError("the long run")
        ours = evidence[claim.id]
        return Finding(ours, f"{ours:g}", of_number(ours, claim.number))

    return claims


def test_claims_are_checked_in_the_printed_order() -> None:
    found = made().evaluate({"P01": 5.2}, only=("P02", "P01"))
    assert [claim.id for claim, _ in found] == ["P01", "P02"]
    assert found[0][1] == Finding(5.2, "5.2", REPRODUCED)
    assert found[1][1] == Finding(None, "left out of this run: the long run", UNKNOWN)


def test_each_claim_has_one_check() -> None:
    claims = made()
    assert list(claims.judged) == ["P01", "P02"]
    with pytest.raises(ValueError, match="P01 is checked twice"):
        claims.judges("P01")(lambda evidence, claim: Finding(None, "", NOT))
    with pytest.raises(LookupError, match=r"nothing checks claim P03: register a function with judges\('P03'\)"):
        claims.evaluate({}, only=("P03",))


def test_registries_are_apart() -> None:
    made()
    assert not Claims("claims_ch2").judged


@pytest.mark.parametrize(
    ("paper", "unit", "shown", "numbers"),
    [
        ("5", "percent", "5 %", (5.0,)),
        ("27.3;34.3", "percent", "27.3, 34.3 %", (27.3, 34.3)),
        ("1;2;3;8", "set index", "1, 2, 3, 8", (1.0, 2.0, 3.0, 8.0)),
        ("149.253", "degC^2", "149.253 °C²", (149.253,)),
        ("6.6", "h", "6.6 h", (6.6,)),
    ],
)
def test_printed_values(paper: str, unit: str, shown: str, numbers: tuple[float, ...]) -> None:
    claim = Claim("X", "", "", paper, unit)
    assert claim.paper_shown == shown
    assert claim.numbers == numbers


def test_an_answer_has_no_unit() -> None:
    assert Claim("X", "", "", "yes", "bool").paper_shown == "yes"


def test_findings_are_shown_stored_and_summed_up() -> None:
    findings = made().evaluate({"P01": 5.4, "P02": 50.0}, only=("P01", "P02"))
    table = findings_table({"": findings}, "The rules.")
    assert table.rows[0] == ("P01", "2.1a", findings[0][0].text, "5 %", "5.4", NEAR)
    assert table.notes == ("The rules.",)
    twice = findings_table({"here": findings, "there": findings}, "The rules.")
    assert [row[4] for row in twice.rows[:2]] == ["here: 5.4", "there: 5.4"]
    assert twice.rows[1][:4] == ("",) * 4
    assert twice.breaks == [1]
    row = findings_document(findings)[1]
    assert (row["id"], row["paper"], row["value"], row["verdict"]) == ("P02", "5", 50.0, NOT)
    assert findings_summary(findings) == "Claims: 0 of 2 reproduced; near: P01; not reproduced: P02."


@pytest.mark.parametrize(
    ("ours", "paper", "verdict"),
    [(105.0, 100.0, REPRODUCED), (89.9, 100.0, NOT), (91.0, 100.0, NEAR), (None, 43.0, NOT), (0.0, 0.0, REPRODUCED)],
)
def test_rule_of_numbers(ours: float | None, paper: float, verdict: str) -> None:
    assert of_number(ours, paper) == verdict


@pytest.mark.parametrize(
    ("hold", "verdict"),
    [
        ("1", REPRODUCED),
        ("0", NOT),
        ("10", PARTLY),
        ("110", NEAR),
        ("1100", PARTLY),
        ("000", NOT),
        ("1111", REPRODUCED),
    ],
)
def test_rule_of_cases(hold: str, verdict: str) -> None:
    assert of_cases([case == "1" for case in hold]) == verdict


@pytest.mark.parametrize(
    ("larger", "verdict"),
    [
        ((2.0, 2.0, 2.0), REPRODUCED),
        ((2.0, 2.0, 1.01), NEAR),
        ((2.0, 1.01, 1.01), PARTLY),
        ((1.01, 1.01, 1.01), PARTLY),  # the right sign in all
        ((1.01, 1.01, 0.9), PARTLY),  # in all but one of three
        ((1.01, 0.9, 0.9), NOT),
        ((1.0, 1.0, 1.0), NOT),
    ],
)
def test_a_right_sign_of_the_wrong_size_is_partly(larger: tuple[float, ...], verdict: str) -> None:
    assert of_comparisons(larger, [1.0] * 3) == verdict


@pytest.mark.parametrize(
    ("kind", "shown"), [(SHARE, "5 %"), (ABSOLUTE, "0.05"), (BELOW, "0.05"), (FACTOR, "factor 0.05")]
)
def test_a_tolerance_is_shown_with_its_unit(kind: str, shown: str) -> None:
    assert Tolerance(0.05, kind).shown == shown


def test_numbers_are_joined() -> None:
    assert joined([1.26, 2.0], ".1f") == "1.3 / 2.0"


@dataclass(frozen=True)
class Root:
    """A square root; the time it takes is that of its number."""

    number: float

    @property
    def cost(self) -> float:
        return abs(self.number)

    @property
    def label(self) -> str:
        return f"root of {self.number:g}"

    def run(self) -> float:
        if self.number < 0:
            raise ValueError(f"{self.number:g} has no root")
        return self.number**0.5


@pytest.mark.parametrize("jobs", [1, 2])
def test_distinct_experiments_run_once_and_report(jobs: int) -> None:
    reports: list[tuple[float, str]] = []
    numbers = (1.0, 9.0, 4.0, 9.0, 2.0)
    results = compute([Root(number) for number in numbers], jobs, lambda *report: reports.append(report))
    assert results == {Root(number): number**0.5 for number in (1.0, 2.0, 4.0, 9.0)}
    assert sorted(label for _, label in reports) == ["root of 1", "root of 2", "root of 4", "root of 9"]
    shares = [share for share, _ in reports]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_the_long_ones_come_first() -> None:
    assert list(compute([Root(1.0), Root(9.0), Root(4.0)])) == [Root(9.0), Root(4.0), Root(1.0)]
    assert compute([]) == {}


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_reaches_the_caller(jobs: int) -> None:
    with pytest.raises(ValueError, match="-3 has no root"):
        compute([Root(-3.0), Root(1.0)], jobs)


def test_results_that_were_left_out_are_named() -> None:
    evidence = Evidence({Root(4.0): 2.0})
    assert evidence[Root(4.0)] == 2.0
    with pytest.raises(NotRunError, match="root of 5"):
        evidence[Root(5.0)]
