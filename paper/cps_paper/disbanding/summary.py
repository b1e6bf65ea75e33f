"""The closing words: what agrees with the paper, what does not, and why; the lists are computed."""

from __future__ import annotations

from collections.abc import Sequence

from cps_paper.chapter import Reproduction
from cps_paper.disbanding.cells import AVERAGED, VelocityErrorPair, table_cells
from cps_paper.disbanding.experiments import DisbandingEvidence
from cps_paper.verdicts import NEAR, NO_SUPPORT, NOT, REPRODUCED, Check, failures

MPC_LABEL = (
    "The paper prints neither horizon nor weights of its MPC. Ours are one set for all cells, tuned on the mpc column "
    "of Table 2.2: read it as MPC (tuned to the paper). Its agreement there is a fit, not a confirmation."
)
WHY = (
    "Why: the paper prints neither the integration step nor the integrator, what happens at a contact, the "
    "transitional controller of the leaders, how drivers brake when they take over, the settings of the MPC, nor over "
    "which vehicles E_v is averaged. Its own numbers constrain these (hence S0, S1, S2) but no single reading gives "
    "all of them: cells with collisions depend on the contact rule, and the crash flags flip between steps of 0.01 s "
    "and 0.02 s. Nothing here is tuned per cell."
)
NOTHING_DRAWN = (
    "Nothing in these cells and claims is drawn, so other seeds change no verdict. --all-interpretations has the "
    "baseline under the other interpretations, --recheck the claims at half the step. Only the genetic search has a "
    "seed."
)


def closing(found: Reproduction[DisbandingEvidence]) -> list[str]:
    """Paragraphs on the parts that were computed."""
    paragraphs = _on_cells(cells_of(found)) + found.claims_summary()
    if paragraphs:
        paragraphs += [WHY, NOTHING_DRAWN, MPC_LABEL]
    paragraphs += _on_checks(found.checks)
    if found.evidence.quick:
        paragraphs.append("--quick left out long strings, grids of alternative attacks and most searches.")
    return paragraphs


def cells_of(found: Reproduction[DisbandingEvidence]) -> list[VelocityErrorPair]:
    """The cells of the tables asked for."""
    return [cell for table in AVERAGED if table in found.parts for cell in table_cells(found.evidence, table)]


def _on_cells(cells: Sequence[VelocityErrorPair]) -> list[str]:
    if not cells:
        return []
    missed, close = ([cell for cell in cells if cell.verdict == word] for word in ("miss", "near"))
    flags = [cell for cell in cells if not cell.crash_agrees]
    matched = len(cells) - len(missed) - len(close)
    text = f"E_v: {matched} of {len(cells)} cells match within 2.0 points, {len(close)} are near (4.0)"
    text += f", {len(missed)} are missed: {_cells(missed)}." if missed else ", none is missed."
    if flags:
        text += f" Crash flags differ in {len(flags)}: {_names(flags)}."
    return [text, *_on_effects(cells)]


def _on_effects(cells: Sequence[VelocityErrorPair]) -> list[str]:
    """A matching cell may hide an effect that is far off: both count."""
    effects = [(cell, cell.effect) for cell in cells if cell.effect is not None]
    if not effects:
        return []
    words = [effect.verdict for _, effect in effects]
    hidden = [
        f"{cell.table} {cell.name} {effect.ours:+.1f} for {effect.paper:+.1f}"
        for cell, effect in effects
        if effect.verdict == NOT and cell.verdict == "match"
    ]
    text = f"Effect of a mitigation on E_v: {words.count(REPRODUCED)} of {len(words)} within 5 % of the paper's"
    text += f", {words.count(NEAR)} near (10 %), {words.count(NOT)} not reproduced"
    if hidden:
        text += f", {len(hidden)} of them in cells whose E_v matches: {', '.join(hidden)}"
    return [f"{text}."]


def _on_checks(checks: Sequence[Check]) -> list[str]:
    if not checks:
        return []
    failed = [check for check in checks if not check.passed]
    flags = [check.subject.cell for check in checks if not check.subject.crash_agrees]
    largest = max(abs(check.difference) for check in checks)
    text = f"Regression check against our second implementation: {len(checks) - len(failed)} of {len(checks)} cells"
    text += f" within their tolerances (0.05 points, mpc 0.3); largest difference {largest:.3f}. {NO_SUPPORT}"
    text += failures(f"{check.label} off by {check.difference:+.3f}" for check in failed)
    if flags:
        text += f" Its crash flags differ in: {_names(flags)}."
    return [text]


def _cells(cells: Sequence[VelocityErrorPair]) -> str:
    return ", ".join(f"{cell.table} {cell.name} {cell.difference:+.1f}" for cell in cells)


def _names(cells: Sequence[VelocityErrorPair]) -> str:
    return ", ".join(f"{cell.table} {cell.name}" for cell in cells)
