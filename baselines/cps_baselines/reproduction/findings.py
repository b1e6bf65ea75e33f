"""Claims with what we find about them: as a table, as plain data, and in one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from cps_baselines.reproduction.block import Block
from cps_baselines.reproduction.claims import Claim, Finding
from cps_baselines.reproduction.verdicts import NEAR, NOT, PARTLY, REPRODUCED, UNKNOWN

Findings = Sequence[tuple[Claim, Finding]]


def findings_block(findings: Findings, rules: str) -> Block:
    """Every claim with its verdict; `rules` says how the verdicts come about."""
    rows = [
        (claim.id, claim.figure, claim.text, claim.paper_shown, finding.shown, finding.verdict)
        for claim, finding in findings
    ]
    return Block("What the text claims", ("", "Where", "Claim", "Paper", "Ours", "Verdict"), rows, 6, (rules,))


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
