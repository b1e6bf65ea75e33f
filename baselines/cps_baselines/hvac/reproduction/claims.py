"""The claims of chapter 4; the functions in `claims_*` check them, and `evaluation` calls these."""

from __future__ import annotations

from cps_baselines.reproduction.claims import Claims
from cps_baselines.reproduction.evidence import Evidence

CLAIMS: Claims[Evidence] = Claims("claims_ch4")
