"""Checking the claims: the registered functions of all modules `claims_*` against the evidence, for both contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cps_baselines.reproduction.claims import Claim, Finding
from cps_baselines.rogue.reproduction import claims_attacks, claims_courses, claims_maps
from cps_baselines.rogue.reproduction.claims import CLAIMS
from cps_baselines.rogue.reproduction.evidence import Evidence
from cps_baselines.rogue.reproduction.settings import CONTACTS

SOURCES = (claims_attacks, claims_courses, claims_maps)  # importing them registers their functions
FindingsByContact = Mapping[str, Sequence[tuple[Claim, Finding]]]


def evaluate(evidence: Evidence) -> FindingsByContact:
    """Every claim with what we find, by contact; what was not simulated in this run stays open."""
    return {contact: CLAIMS.evaluate(evidence.under(contact)) for contact in CONTACTS}
