from __future__ import annotations

import pytest

from cps_baselines.reproduction.claims import (
    Claim,
    Claims,
    Finding,
    findings_document,
    findings_summary,
    findings_table,
    joined,
)
from cps_baselines.reproduction.evidence import NotRunError
from cps_baselines.reproduction.verdicts import NEAR, NOT, PARTLY, REPRODUCED, UNKNOWN, of_cases, of_number


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


def test_numbers_are_joined() -> None:
    assert joined([1.26, 2.0], ".1f") == "1.3 / 2.0"
