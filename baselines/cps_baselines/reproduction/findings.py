"""Claims with what we find about them: as a table, as plain data, in one sentence, and counted under one reading."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from cps_baselines.reproduction.claims import Claim, Finding
from cps_baselines.reproduction.exhibit import Table, places
from cps_baselines.reproduction.verdicts import NEAR, NOT, PARTLY, REPRODUCED, UNKNOWN

Findings = Sequence[tuple[Claim, Finding]]


def findings_table(found: Mapping[str, Findings], rules: str) -> Table:
    """Every claim with its verdict, under each reading if there are several; `rules` says how verdicts come about."""
    rows = []
    for each in zip(*found.values(), strict=True):
        for k, (reading, (claim, finding)) in enumerate(zip(found, each, strict=True)):
            named = (claim.id, claim.figure, claim.text, claim.paper_shown) if k == 0 else ("",) * 4
            shown = f"{reading}: {finding.shown}" if len(found) > 1 else finding.shown
            rows.append((*named, shown, finding.verdict))
    after = range(len(found) - 1, len(rows) - 1, len(found)) if len(found) > 1 else ()
    columns = places("", "Where", "Claim", "Paper", "Ours", "Verdict")
    return Table("What the text claims", columns, rows, (rules,), left=6, after=after)


def findings_document(findings: Findings) -> list[dict[str, Any]]:
    """Every claim with our finding, for JSON."""
    return [{**asdict(claim), **asdict(finding)} for claim, finding in findings]


def findings_summary(findings: Findings) -> str:
    """How many claims are reproduced, and which are not."""
    by_verdict = {
        word: [claim.id for claim, finding in findings if finding.verdict == word]
        for word in (REPRODUCED, NEAR, PARTLY, NOT, UNKNOWN)
    }
    text = f"Claims: {len(by_verdict[REPRODUCED])} of {len(findings)} reproduced"
    for word in (NEAR, PARTLY, NOT, UNKNOWN):
        if by_verdict[word]:
            text += f"; {word}: {', '.join(by_verdict[word])}"
    return text + "."


MEANING = {"match": REPRODUCED, "miss": NOT, "rough": PARTLY, "far": NOT}  # words for cells -> words for claims
CLAIMS, CELLS, EFFECTS = "claims", "cells", "effects"


@dataclass(frozen=True)
class Tally:
    """The verdicts on one kind of statement under one reading."""

    reading: str  # how what the text leaves open was read, such as "contact pass"
    kind: str  # CLAIMS, CELLS or EFFECTS
    verdicts: Mapping[str, str]  # by the statement's id; words of `verdicts.VERDICTS`

    @property
    def counts(self) -> Mapping[str, int]:
        """How many statements got each verdict."""
        return Counter(self.verdicts.values())


def tally(reading: str, kind: str, verdicts: Iterable[tuple[str, str]]) -> Tally:
    """Statements by id with their verdicts; the words for cells count as those for claims.

    Raises:
        ValueError: two statements have the same id.
    """
    found: dict[str, str] = {}
    for name, verdict in verdicts:
        if name in found:
            raise ValueError(f"two statements are called {name!r}")
        found[name] = MEANING.get(verdict, verdict)
    return Tally(reading, kind, found)


def tally_claims(reading: str, findings: Findings) -> Tally:
    """The claims of a chapter."""
    return tally(reading, CLAIMS, ((claim.id, finding.verdict) for claim, finding in findings))
