"""The claims of chapter 2; the functions in `claims_*` check them, and `evaluation` calls these."""

from __future__ import annotations

from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.reproduction.claims import Claims

CLAIMS: Claims[Evidence] = Claims("claims_ch2")
