"""Reproducing chapter 2, or parts of it: simulate, compare, and hand over as tables, words or plain data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from cps_baselines.disbanding.reproduction import blocks, document, played_blocks, plot_2_1, plot_2_3
from cps_baselines.disbanding.reproduction.cells import Cell, table_cells
from cps_baselines.disbanding.reproduction.evaluation import evaluate
from cps_baselines.disbanding.reproduction.evidence import Evidence
from cps_baselines.disbanding.reproduction.optimal import optima
from cps_baselines.disbanding.reproduction.recheck import CONDITIONS
from cps_baselines.disbanding.reproduction.reference import Check, check
from cps_baselines.disbanding.reproduction.rules import RULES
from cps_baselines.disbanding.reproduction.selection import needed
from cps_baselines.disbanding.reproduction.summary import closing
from cps_baselines.reproduction.evidence import Report, compute
from cps_baselines.reproduction.findings import Findings, findings_document, findings_table
from cps_baselines.reproduction.recheck import Again, Condition, again_document, again_summary, judge_again, with_again
from cps_baselines.reproduction.tally import CELLS, EFFECTS, Tally, tally, tally_claims
from cps_envs.disbanding.config import INTERPRETATIONS


@dataclass(frozen=True)
class Reproduction:
    """Parts of the chapter, simulated under one interpretation."""

    parts: Sequence[str]
    evidence: Evidence
    quick: bool = False
    all_interpretations: bool = False
    conditions: Sequence[Condition] = ()  # under which the claims are judged again

    @cached_property
    def cells(self) -> list[Cell]:
        """The cells of the tables asked for."""
        return [cell for table in ("2.2", "2.3") if table in self.parts for cell in table_cells(self.evidence, table)]

    @cached_property
    def findings(self) -> Findings:
        """All claims, if asked for; where a verdict changes when judged again, it says so."""
        return with_again(evaluate(self.evidence), self.again) if "claims" in self.parts else []

    @cached_property
    def again(self) -> list[Again]:
        """The verdicts under other conditions."""
        return judge_again(self.evidence, self.conditions, evaluate)

    @cached_property
    def checks(self) -> list[Check]:
        """The cells that have a reference, those of the other interpretations included."""
        cells = list(self.cells)
        for name in INTERPRETATIONS if self.all_interpretations else ():
            for table in ("2.2", "2.3"):
                cells += table_cells(self.evidence.under(name), table, ("baseline",))
        distinct = {(cell.table, cell.interpretation, cell.name): cell for cell in cells}
        return check(list(distinct.values()))

    @property
    def passed(self) -> bool:
        """Whether every cell is within its tolerance of the reference; misses against the paper do not count."""
        return all(each.passed for each in self.checks)

    def tallies(self) -> list[Tally]:
        """How many claims, cells of the tables and effects of mitigations are reproduced."""
        reading = f"interpretation {self.evidence.experiments.interpretation}"
        named = [(f"{cell.table} {cell.name}", cell) for cell in self.cells]
        effects = ((name, cell.effect.verdict) for name, cell in named if cell.effect is not None)
        return [
            tally_claims(reading, self.findings),
            tally(reading, CELLS, ((name, cell.verdict) for name, cell in named)),
            tally(reading, EFFECTS, effects),
        ]

    def blocks(self) -> list[Any]:
        """Tables for readers."""
        makers: dict[str, Callable[[], list[Any]]] = {
            "2.2": lambda: blocks.cell_blocks(self.evidence, "2.2"),
            "2.3": lambda: blocks.cell_blocks(self.evidence, "2.3"),
            "2.1fig": lambda: blocks.figure_2_1_blocks(self.evidence),
            "2.3fig": lambda: blocks.figure_2_3_blocks(self.evidence),
            "platoons": lambda: played_blocks.platoons_blocks(self.evidence),
            "text": lambda: played_blocks.text_blocks(self.evidence),
            "ga": lambda: blocks.search_blocks(self.evidence),
            "claims": lambda: [findings_table({"": self.findings}, RULES)],
        }
        made = [block for part in self.parts for block in makers[part]()]
        return made + (blocks.interpretation_blocks(self.evidence) if self.all_interpretations else [])

    def closing(self) -> list[str]:
        """Paragraphs that say what is not reproduced, and why."""
        words = closing(self.cells, self.findings, self.checks, quick=self.quick)
        return words + again_summary(self.findings, self.again)

    def document(self) -> dict[str, Any]:
        """Plain data for JSON."""
        evidence = self.evidence
        makers: dict[str, Callable[[], Any]] = {
            "2.2": lambda: document.table_document(table_cells(evidence, "2.2")),
            "2.3": lambda: document.table_document(table_cells(evidence, "2.3")),
            "2.1fig": lambda: document.figure_2_1_document(evidence),
            "2.3fig": lambda: document.figure_2_3_document(evidence),
            "platoons": lambda: document.platoons_document(evidence),
            "text": lambda: document.text_document(evidence),
            "ga": lambda: document.search_document(optima(evidence)),
            "claims": lambda: findings_document(self.findings),
        }
        return {
            "chapter": 2,
            "interpretation": evidence.experiments.interpretation,
            "quick": self.quick,
            "parts": {part: makers[part]() for part in self.parts},
            "interpretations": self._interpretations() if self.all_interpretations else {},
            "again": again_document(self.again),
            "regression": document.checks_document(self.checks),
            "closing": self.closing(),
        }

    def figures(self) -> Iterator[tuple[str, Any]]:
        """File names and matplotlib figures of the parts that are figures.

        Raises:
            MissingExtraError: matplotlib is not installed.
        """
        for part, name, draw in (("2.1fig", "figure_2_1", plot_2_1.draw), ("2.3fig", "figure_2_3", plot_2_3.draw)):
            if part in self.parts:
                yield name, draw(self.evidence)

    def _interpretations(self) -> dict[str, Any]:
        documents = {}
        for name in INTERPRETATIONS:
            there = self.evidence.under(name)
            documents[name] = {
                "tables": {
                    table: document.table_document(table_cells(there, table, ("baseline",))) for table in ("2.2", "2.3")
                },
                "claims": findings_document(evaluate(there, ("P29", "P39"))),
            }
        return documents


def reproduce_chapter(
    parts: Sequence[str],
    interpretation: str = "S0",
    *,
    jobs: int = 1,
    quick: bool = False,
    all_interpretations: bool = False,
    recheck: bool = False,
    report: Report | None = None,
) -> Reproduction:
    """Simulate what the parts (keys of `selection.PARTS`) need; `recheck` judges the claims under `CONDITIONS` as well.

    `jobs` processes share the work; they are spawned, so a script must guard its main part. `report` is told the share
    of the work done.
    """
    conditions = CONDITIONS if recheck and "claims" in parts else ()
    todo = needed(parts, interpretation, quick=quick, all_interpretations=all_interpretations)
    for condition in conditions:
        todo += condition.experiments(needed(("claims",), interpretation, quick=quick, all_interpretations=False))
    evidence = Evidence(compute(todo, jobs, report), interpretation=interpretation)
    return Reproduction(tuple(parts), evidence, quick, all_interpretations, conditions)
