"""How many statements got which verdict under one reading of the text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from cps_baselines.reproduction.findings import Findings
from cps_baselines.reproduction.verdicts import NOT, PARTLY, REPRODUCED

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
