"""Reproducing chapter 4, or parts of it: simulate, compare, and hand over as tables, words or plain data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from cps_baselines.hvac.reproduction import blocks, document, figures
from cps_baselines.hvac.reproduction.cells import Row, table_rows
from cps_baselines.hvac.reproduction.controllers import CLIP, Controller
from cps_baselines.hvac.reproduction.evaluation import evaluate
from cps_baselines.hvac.reproduction.measures import measures
from cps_baselines.hvac.reproduction.recheck import CONDITIONS
from cps_baselines.hvac.reproduction.reference import Check, check
from cps_baselines.hvac.reproduction.rules import RULES
from cps_baselines.hvac.reproduction.selection import CLAIMS, EARLY, FIGURES, TABLES, needed
from cps_baselines.hvac.reproduction.summary import closing
from cps_baselines.reproduction.evidence import Evidence, Report, compute
from cps_baselines.reproduction.findings import Findings, findings_document, findings_table
from cps_baselines.reproduction.recheck import (
    Again,
    Condition,
    again_document,
    again_summary,
    judge_again,
    with_again,
)
from cps_baselines.reproduction.tally import CELLS, Tally, tally, tally_claims


@dataclass(frozen=True)
class Reproduction:
    """Parts of the chapter, simulated."""

    parts: Sequence[str]
    evidence: Evidence
    quick: bool = False
    conditions: Sequence[Condition] = ()  # under which the claims are judged again
    controller: Controller = CLIP  # the reading of (4.17)

    @cached_property
    def tables(self) -> dict[str, list[Row]]:
        """The tables asked for."""
        return {part: table_rows(self.evidence, part) for part in self.parts if part in TABLES}

    @cached_property
    def findings(self) -> Findings:
        """All claims, if asked for; where a verdict changes when judged again, it says so."""
        return with_again(evaluate(self.evidence), self.again) if CLAIMS in self.parts else []

    @cached_property
    def again(self) -> list[Again]:
        """The verdicts under other conditions."""
        return judge_again(self.evidence, self.conditions, evaluate)

    @cached_property
    def checks(self) -> list[Check]:
        """The numbers of this run that have a reference: it has the controller that clips."""
        return check(measures(self.evidence)) if self.controller == CLIP else []

    @property
    def passed(self) -> bool:
        """Whether our numbers are those of the reference, or where they never were, what they were."""
        return all(each.passed for each in self.checks)

    def tallies(self) -> list[Tally]:
        """How many claims and cells of the tables are reproduced."""
        cells = [
            (f"{table} {cell.paper.percent} % {cell.paper.sensors_used} zone {cell.paper.zone}", cell.verdict)
            for table, rows in self.tables.items()
            for row in rows
            for cell in row.cells
        ]
        reading = self.controller.reading
        return [tally_claims(reading, self.findings), tally(reading, CELLS, cells)]

    def blocks(self) -> list[Any]:
        """Tables for readers."""
        evidence = self.evidence
        makers: dict[str, Callable[[], list[Any]]] = {
            "4.1": lambda: [blocks.table_block(evidence, "4.1")],
            "4.2": lambda: [blocks.table_block(evidence, "4.2")],
            "4.2fig": lambda: [blocks.clear_day_block(evidence)],
            "4.3fig": lambda: [blocks.energies_block(evidence)],
            "4.4fig": lambda: blocks.undefended_blocks(evidence),
            "4.5fig": lambda: [blocks.observers_block(evidence)],
            "4.6fig": lambda: [blocks.sets_block(evidence)],
            "4.7fig": lambda: blocks.bars_blocks(evidence, 4),
            "4.8fig": lambda: blocks.bars_blocks(evidence, 8),
            EARLY: lambda: [blocks.early_block(evidence)],
            CLAIMS: lambda: [findings_table({"": self.findings}, RULES)],
        }
        return [block for part in self.parts for block in makers[part]()]

    def closing(self) -> list[str]:
        """Paragraphs that say what is not reproduced, and why."""
        words = closing(
            self.parts, self.tables, self.findings, self.checks, quick=self.quick, controller=self.controller
        )
        return words + again_summary(self.findings, self.again)

    def document(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "chapter": 4,
            "controller": self.controller.name,
            "settings": dict(self.controller.settings),
            "quick": self.quick,
            "parts": {part: self._part_document(part) for part in self.parts},
            "again": again_document(self.again),
            "regression": document.checks_document(self.checks),
            "closing": self.closing(),
        }

    def figures(self) -> Iterator[tuple[str, Any]]:
        """File names and matplotlib figures of the parts that are figures.

        Raises:
            MissingExtraError: matplotlib is not installed.
        """
        for part in self.parts:
            if part in FIGURES:
                yield f"figure_{part.removesuffix('fig').replace('.', '_')}", figures.draw(self.evidence, part)

    def _part_document(self, part: str) -> Any:
        if part in TABLES:
            return document.table_document(self.tables[part])
        if part in FIGURES:
            return document.figure_document(self.evidence, part)
        return document.early_document(self.evidence) if part == EARLY else findings_document(self.findings)


def reproduce_chapter(
    parts: Sequence[str],
    *,
    jobs: int = 1,
    quick: bool = False,
    recheck: bool = False,
    controller: Controller = CLIP,
    report: Report | None = None,
) -> Reproduction:
    """Simulate what the parts (of `selection.PARTS`) need; `recheck` judges the claims under `CONDITIONS` as well.

    `jobs` processes share the work; they are spawned, so a script must guard its main part. `report` is told the share
    of the work done. `quick` leaves Table 4.2 and eight sensors out of the claims.
    """
    conditions = CONDITIONS if recheck and CLAIMS in parts else ()
    todo = needed(parts, quick=quick)
    for condition in conditions:
        todo += condition.experiments(needed((CLAIMS,), quick=quick))
    results = compute([controller.under(each) for each in todo], jobs, report)
    return Reproduction(tuple(parts), Evidence(results, vary=controller.under), quick, conditions, controller)
