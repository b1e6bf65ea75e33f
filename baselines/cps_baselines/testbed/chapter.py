"""Reproducing section 2.5: simulate, compare, and hand over as tables, words or plain data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from cps_baselines.reproduction.block import Block
from cps_baselines.reproduction.claims import Claim, Finding
from cps_baselines.reproduction.evidence import Report, compute
from cps_baselines.reproduction.findings import findings_document, findings_summary
from cps_baselines.reproduction.regression import NO_SUPPORT
from cps_baselines.reproduction.tally import Tally, tally_claims
from cps_baselines.reproduction.verdicts import NEAR_SHARE, SAME_SHARE
from cps_baselines.testbed.blocks import cases_block, claims_block, printed_errors, seeds_block
from cps_baselines.testbed.cases import BASE, CASES, LONG_S, Case
from cps_baselines.testbed.claims import CLAIMS, deviation
from cps_baselines.testbed.plot import draw
from cps_baselines.testbed.reference import Check, check
from cps_baselines.testbed.results import MITIGATED_CASES, Results, needed

STAND_IN = (
    "This is a simulated stand-in for the robots: of the experiment the paper prints t_s and three values of E_v, and "
    "nearly every other number here is chosen. It can say whether a mitigation works on such a plant, and it cannot "
    "confirm the hardware. The paper's gains of 27 and 34 % come from one run of each case."
)


@dataclass(frozen=True)
class Reproduction:
    """The three experiments over some seeds."""

    results: Results
    quick: bool = False

    @cached_property
    def findings(self) -> list[tuple[Claim, Finding]]:
        """All claims."""
        return CLAIMS.evaluate(self.results)

    @cached_property
    def checks(self) -> list[Check]:
        """The three E_v beside the reference."""
        return [check(case.figure, self.results.errors(case)) for case in CASES]

    @property
    def passed(self) -> bool:
        """Whether the three E_v lie within the reference's spread, and in its order in enough seeds."""
        return all(each.passed for each in self.checks) and self.results.in_order

    def tallies(self) -> list[Tally]:
        """How many claims are reproduced."""
        return [tally_claims("simulated robots", self.findings)]

    def blocks(self) -> list[Block]:
        """Tables for readers."""
        return [cases_block(self.results), seeds_block(self.results), claims_block(self.findings)]

    def closing(self) -> list[str]:
        """Paragraphs that say what is not reproduced, and why."""
        words = [findings_summary(self.findings), STAND_IN, self._on_recovery(), self._on_checks()]
        return [*words, f"--quick left out the runs of {LONG_S:g} s."] if self.quick else words

    def _on_recovery(self) -> str:
        """Why speeds do not come back, and that they say nothing about the mitigation."""
        mitigated = [self.results.recovery(case) for case in MITIGATED_CASES]
        ahead, intact = np.mean([each.shares for each in mitigated], axis=0)
        follows = np.concatenate([each.follows() for each in mitigated])
        with_it = np.concatenate([each.recovered(NEAR_SHARE) for each in mitigated])
        without = self.results.recovery(BASE).recovered(NEAR_SHARE)
        return (
            "Why speed does not recover (T13): a human driver at a finite gap stays below v_d by (2.5). At the end the "
            f"robot ahead of the intact ones, which a driver steers since the attack, has {ahead:.0%} of its speed "
            f"without the attack, and the intact ones have {intact:.0%}. Relative to the robot ahead they are as fast "
            f"as without the attack, within {SAME_SHARE:.0%}, in {follows.sum()} of {len(follows)} runs. Recovery does "
            f"not speak for the mitigation: speeds and gaps are within {NEAR_SHARE:.0%} in {with_it.sum()} of "
            f"{len(with_it)} runs with it and in {without.sum()} of {len(without)} without."
        )

    def _on_checks(self) -> str:
        parts = (
            f"{each.figure} {each.difference:+.2f} of {each.reference.allowance(each.num_seeds):.2f} points allowed"
            for each in self.checks
        )
        ordered, seeds = int(self.results.ordered.sum()), self.results.num_seeds
        text = f"Regression check against our second implementation: {'; '.join(parts)}."
        text += f" In order in {ordered} of {seeds} seeds. {NO_SUPPORT}"
        return text if self.passed else f"{text} FAILED: the simulation has changed."

    def document(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "section": "2.5",
            "quick": self.quick,
            "seeds": self.results.num_seeds,
            "cases": [self._case(case) for case in CASES],
            "in_order": self.results.ordered,
            "claims": findings_document(self.findings),
            "regression": [
                {**asdict(each), "difference": each.difference, "passed": each.passed} for each in self.checks
            ],
            "passed": self.passed,
            "closing": self.closing(),
        }

    def _case(self, case: Case) -> dict[str, Any]:
        errors, paper = self.results.errors(case), printed_errors()[case.claim]
        return {
            "figure": case.figure,
            "case": case.name,
            "defender": case.defender,
            "velocity_error_percent": {"paper": paper, "mean": float(errors.mean()), "deviation": deviation(errors)},
            "metrics": self.results.of(case).metrics,
        }

    def figures(self) -> Iterator[tuple[str, Any]]:
        """Fig. 2.5.

        Raises:
            MissingExtraError: matplotlib is not installed.
        """
        yield "figure_2_5", draw(self.results)


def reproduce_section(
    num_seeds: int, *, jobs: int = 1, quick: bool = False, report: Report | None = None
) -> Reproduction:
    """Simulate the three cases under the seeds 0, 1, ...; `quick` leaves out the long runs.

    `jobs` processes share the work; they are spawned, so a script must guard its main part. `report` is told the share
    of the work done.
    """
    return Reproduction(Results(compute(needed(num_seeds, quick=quick), jobs, report), num_seeds), quick)
