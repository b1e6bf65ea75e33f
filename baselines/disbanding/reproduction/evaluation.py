"""Checking the claims: the registered functions of all modules `claims_*` against the evidence."""

from __future__ import annotations

from baselines.disbanding.reproduction import claims_2_1, claims_2_3, claims_2_4
from baselines.disbanding.reproduction.claims import JUDGES, Claim, Finding, paper_claims
from baselines.disbanding.reproduction.evidence import Evidence, NotRunError
from baselines.disbanding.reproduction.verdicts import UNKNOWN

SOURCES = (claims_2_1, claims_2_3, claims_2_4)  # importing them registers their functions


def evaluate(evidence: Evidence, only: tuple[str, ...] = ()) -> list[tuple[Claim, Finding]]:
    """Every claim, or those named, with what we find; what was not simulated in this run stays open."""
    return [(claim, _judged(evidence, claim)) for claim in paper_claims() if not only or claim.id in only]


def _judged(evidence: Evidence, claim: Claim) -> Finding:
    try:
        return JUDGES[claim.id](evidence, claim)
    except NotRunError as missing:
        return Finding(None, f"left out of this run: {missing}", UNKNOWN)
