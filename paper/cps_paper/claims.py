"""What a chapter says in words, claim by claim, the functions that check it, and what we find about it.

Findings are a table, plain data, one sentence, or counts under one reading.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Generic, TypeVar

from cps_paper.evidence import NotRunError
from cps_paper.exhibit import ExhibitTable, places
from cps_paper.printed.tables import read_table
from cps_paper.verdicts import (
    GIVEN,
    NEAR,
    NOT,
    OPEN,
    PARTLY,
    REPRODUCED,
    UNKNOWN,
    Tolerance,
    of_cases,
    of_comparisons,
    of_number,
)

SHOWN_UNITS = {
    "bool": "",
    "platoon index": "",
    "set index": "",
    "percent": "%",
    "percent of E": "% of E",
    "degC": "°C",
    "degC^2": "°C²",
}
Value = float | bool | Sequence[float] | None
Source = TypeVar("Source")  # what a chapter's claims are checked against


@dataclass(frozen=True)
class Claim:
    """A claim as the paper makes it."""

    id: str  # "P01"
    figure: str  # figure, table or section, "2.1b"
    text: str
    paper: str  # a number, several separated by semicolons, or "yes"
    unit: str

    @property
    def number(self) -> float:
        """The paper's value where it is a number."""
        return float(self.paper)

    @property
    def numbers(self) -> tuple[float, ...]:
        """The paper's values where there are one or several."""
        return tuple(map(float, self.paper.split(";")))

    @property
    def paper_shown(self) -> str:
        """The paper's value with its unit."""
        value = self.paper.replace(";", ", ")
        return f"{value} {SHOWN_UNITS.get(self.unit, self.unit)}".rstrip()


@dataclass(frozen=True)
class Finding:
    """What our code finds about a claim."""

    value: Value  # the number or answer beside the paper's; None where there is none
    shown: str  # the same with its unit and what else is worth knowing, for readers
    verdict: str  # one of verdicts.VERDICTS

    @classmethod
    def of_cases(cls, hold: Sequence[bool], shown: str) -> Finding:
        """About a statement that has to hold in every case."""
        return cls(all(hold), shown, of_cases(hold))

    @classmethod
    def of_comparisons(cls, larger: Sequence[float], smaller: Sequence[float], shown: str) -> Finding:
        """About pairs of positive numbers of which the first has to be clearly larger."""
        verdict = of_comparisons(larger, smaller)
        return cls(verdict == REPRODUCED, shown, verdict)

    @classmethod
    def of_number(cls, ours: float | None, claim: Claim, shown: str, *tolerances: Tolerance) -> Finding:
        """About a number, by the common rule."""
        return cls(ours, shown, of_number(ours, claim.number, *tolerances))


Judge = Callable[[Source, Claim], Finding]


class Claims(Generic[Source]):
    """The claims of one table of the paper, columns id, figure, claim, paper_value and unit; one function checks each.

        CLAIMS: Claims[Evidence] = Claims("claims_ch2")

        @CLAIMS.judges("P01", "P02")
        def share(evidence: Evidence, claim: Claim) -> Finding: ...

        CLAIMS.evaluate(evidence)

    Modules that register functions have to be imported before `evaluate`.
    """

    def __init__(self, table: str) -> None:
        self._table = table
        self._judges: dict[str, Judge[Source]] = {}

    @property
    def judged(self) -> Collection[str]:
        """The ids that a function has been registered for."""
        return self._judges.keys()

    def judges(self, *ids: str) -> Callable[[Judge[Source]], Judge[Source]]:
        """Register the function that checks these claims.

        Raises:
            ValueError: another one does so already.
        """

        def register(judge: Judge[Source]) -> Judge[Source]:
            for name in ids:
                if name in self._judges:
                    raise ValueError(f"claim {name} is checked twice")
                self._judges[name] = judge
            return judge

        return register

    def printed(self) -> list[Claim]:
        """All claims in the paper's order."""
        return [
            Claim(row["id"], row["figure"], row["claim"], row["paper_value"], row["unit"])
            for row in read_table(self._table)
        ]

    def number(self, name: str) -> float:
        """What the paper prints for the claim with this id."""
        (found,) = (claim.number for claim in self.printed() if claim.id == name)
        return found

    def evaluate(self, evidence: Source, only: Sequence[str] = ()) -> list[tuple[Claim, Finding]]:
        """Every claim, or those named, with what we find; what was not simulated in this run stays open.

        Raises:
            LookupError: nothing has been registered for a claim.
        """
        return [(claim, self._finding(evidence, claim)) for claim in self.printed() if not only or claim.id in only]

    def _finding(self, evidence: Source, claim: Claim) -> Finding:
        judge = self._judges.get(claim.id)
        if judge is None:
            raise LookupError(f"nothing checks claim {claim.id}: register a function with judges({claim.id!r})")
        try:
            return judge(evidence, claim)
        except NotRunError as missing:
            return Finding(None, f"left out of this run: {missing}", UNKNOWN)


def applying(count: int, total: int, things: str) -> str:
    """Of how many things a claim speaks, where it drops some; said wherever it does."""
    return f"{count} of {total} {things} apply"


def joined(values: Sequence[float], form: str = ".0f") -> str:
    """Numbers separated by slashes."""
    return " / ".join(format(value, form) for value in values)


Findings = Sequence[tuple[Claim, Finding]]


def findings_table(found: Mapping[str, Findings], rules: str) -> ExhibitTable:
    """Every claim with its verdict, under each reading if there are several; `rules` says how verdicts come about."""
    rows = []
    for each in zip(*found.values(), strict=True):
        for k, (reading, (claim, finding)) in enumerate(zip(found, each, strict=True)):
            named = (claim.id, claim.figure, claim.text, claim.paper_shown) if k == 0 else ("",) * 4
            shown = f"{reading}: {finding.shown}" if len(found) > 1 else finding.shown
            rows.append((*named, shown, finding.verdict))
    after = range(len(found) - 1, len(rows) - 1, len(found)) if len(found) > 1 else ()
    columns = places("", "Where", "Claim", "Paper", "Ours", "Verdict")
    return ExhibitTable("What the text claims", columns, rows, (rules,), left=6, after=after)


def findings_document(findings: Findings) -> list[dict[str, Any]]:
    """Every claim with our finding, for JSON."""
    return [{**asdict(claim), **asdict(finding)} for claim, finding in findings]


def findings_summary(findings: Findings) -> str:
    """How many claims are reproduced, and which are not."""
    by_verdict = {
        word: [claim.id for claim, finding in findings if finding.verdict == word]
        for word in (REPRODUCED, NEAR, PARTLY, NOT, GIVEN, OPEN, UNKNOWN)
    }
    text = f"Claims: {len(by_verdict[REPRODUCED])} of {len(findings)} reproduced"
    for word in (NEAR, PARTLY, NOT, GIVEN, OPEN, UNKNOWN):
        if by_verdict[word]:
            text += f"; {word}: {', '.join(by_verdict[word])}"
    return text + "."


MEANING = {"match": REPRODUCED, "miss": NOT, "rough": PARTLY, "far": NOT}  # words for cells -> words for claims
CLAIMS, CELLS, EFFECTS, FITTED = "claims", "cells", "effects", "cells, fitted horizons"


@dataclass(frozen=True)
class ClaimTally:
    """The verdicts on one kind of statement under one reading."""

    reading: str  # how what the text leaves open was read, such as "contact pass"
    kind: str  # CLAIMS, CELLS, EFFECTS or FITTED
    verdicts: Mapping[str, str]  # by the statement's id; words of `verdicts.VERDICTS`

    @property
    def counts(self) -> Mapping[str, int]:
        """How many statements got each verdict."""
        return Counter(self.verdicts.values())


def tally(reading: str, kind: str, verdicts: Iterable[tuple[str, str]]) -> ClaimTally:
    """Statements by id with their verdicts; the words for cells count as those for claims.

    Raises:
        ValueError: two statements have the same id.
    """
    found: dict[str, str] = {}
    for name, verdict in verdicts:
        if name in found:
            raise ValueError(f"two statements are called {name!r}")
        found[name] = MEANING.get(verdict, verdict)
    return ClaimTally(reading, kind, found)


def tally_claims(reading: str, findings: Findings) -> ClaimTally:
    """The claims of a chapter."""
    return tally(reading, CLAIMS, ((claim.id, finding.verdict) for claim, finding in findings))
