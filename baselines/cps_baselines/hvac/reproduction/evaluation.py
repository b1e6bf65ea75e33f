"""Checking the claims: the registered functions of all modules `claims_*` against the evidence."""

from __future__ import annotations

from collections.abc import Sequence

from cps_baselines.hvac.reproduction import claims_4_2, claims_4_4, claims_4_5, claims_4_6, claims_4_7, claims_tables
from cps_baselines.hvac.reproduction.claims import CLAIMS
from cps_baselines.reproduction.claims import Claim, Finding
from cps_baselines.reproduction.evidence import Evidence

SOURCES = (claims_4_2, claims_4_4, claims_4_5, claims_4_6, claims_4_7, claims_tables)  # importing registers them


def evaluate(evidence: Evidence, only: Sequence[str] = ()) -> list[tuple[Claim, Finding]]:
    """Every claim, or those named, with what we find; what was not simulated in this run stays open."""
    return CLAIMS.evaluate(evidence, only)
