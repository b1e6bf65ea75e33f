"""Checking the claims: the registered functions of all modules `claims_*` against the evidence."""

from __future__ import annotations

from collections.abc import Sequence

from cps_baselines.disbanding.reproduction import claims_2_1, claims_2_3, claims_2_4
from cps_baselines.disbanding.reproduction.claims import CLAIMS
from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.reproduction.claims import Claim, Finding

SOURCES = (claims_2_1, claims_2_3, claims_2_4)  # importing them registers their functions


def evaluate(evidence: Evidence, only: Sequence[str] = ()) -> list[tuple[Claim, Finding]]:
    """Every claim, or those named, with what we find; what was not simulated in this run stays open."""
    return CLAIMS.evaluate(evidence, only)
