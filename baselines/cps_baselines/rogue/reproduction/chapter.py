"""Reproducing chapter 5, or parts of it: simulate, compare, and hand over as tables, words or plain data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from cps_baselines.reproduction.block import Block
from cps_baselines.reproduction.evidence import Report, compute
from cps_baselines.reproduction.recheck import Again, Condition, again_document, again_summary, judge_again, with_again
from cps_baselines.reproduction.tally import Tally, tally_claims
from cps_baselines.rogue.reproduction import blocks, document, plot_courses, plot_errors, plot_maps
from cps_baselines.rogue.reproduction.claims import CLAIMS
from cps_baselines.rogue.reproduction.evaluation import FindingsByContact, evaluate
from cps_baselines.rogue.reproduction.evidence import Evidence
from cps_baselines.rogue.reproduction.fit import FURTHER, OWN, Maps, Variant, fits
from cps_baselines.rogue.reproduction.headroom import GENERAL_RIDE, HeadRoom, head_rooms
from cps_baselines.rogue.reproduction.parts import COURSES, behind_claims, needed
from cps_baselines.rogue.reproduction.recheck import CONDITIONS
from cps_baselines.rogue.reproduction.reference import Check, check
from cps_baselines.rogue.reproduction.settings import CONTACTS, MAPS
from cps_baselines.rogue.reproduction.summary import closing


@dataclass(frozen=True)
class Reproduction:
    """Parts of the chapter."""

    parts: Sequence[str]
    evidence: Evidence
    quick: bool = False
    conditions: Sequence[Condition] = ()  # under which the claims are judged again

    @cached_property
    def findings(self) -> FindingsByContact:
        """All claims by contact, if asked for; where a verdict changes when judged again, it says so."""
        found = evaluate(self.evidence) if "claims" in self.parts else {}
        return {contact: with_again(each, self.again[contact]) for contact, each in found.items()}

    @cached_property
    def again(self) -> dict[str, list[Again]]:
        """The verdicts under other conditions, by contact."""
        views = {contact: self.evidence.under(contact) for contact in CONTACTS}
        return {contact: judge_again(view, self.conditions, CLAIMS.evaluate) for contact, view in views.items()}

    @cached_property
    def fits(self) -> list[tuple[Variant, Maps, list[bool]]]:
        """Which orderings survive which changes, if asked for."""
        return list(fits(self.evidence, (*OWN, *FURTHER))) if "fit" in self.parts else []

    @cached_property
    def head_rooms(self) -> list[HeadRoom]:
        """Kinds of attackers, if asked for."""
        return head_rooms(self.evidence) if "headroom" in self.parts else []

    @cached_property
    def checks(self) -> list[Check]:
        """What has a reference."""
        return check(self.evidence, maps=self._has_maps)

    @property
    def passed(self) -> bool:
        """Whether our damages are those of the reference; claims that do not hold do not count."""
        return all(each.passed for each in self.checks)

    def tallies(self) -> list[Tally]:
        """How many claims are reproduced, with each contact."""
        return [tally_claims(f"contact {contact}", found) for contact, found in self.findings.items()]

    def blocks(self) -> list[Block]:
        """Tables for readers."""
        makers: dict[str, Callable[[], list[Block]]] = {
            "5.2": lambda: [blocks.sway_block(self.evidence)],
            "5.4": lambda: [blocks.circles_block(self.evidence)],
            "seats": lambda: [blocks.seats_block(self.evidence)],
            **{
                number: lambda number=number: [blocks.courses_block(self.evidence, number, COURSES[number])]  # type: ignore[misc]
                for number in COURSES
            },
            "maps": lambda: [blocks.maps_block(self.evidence), blocks.line_block()],
            "claims": lambda: [blocks.claims_block(self.findings)],
            "fit": lambda: [blocks.fit_block(self.fits)],
            "headroom": lambda: [blocks.head_room_block(self.head_rooms)],
        }
        return [block for part in self.parts for block in makers[part]()]

    def closing(self) -> list[str]:
        """Paragraphs that say what is not reproduced, and why."""
        peaks = {self.evidence.map(defender).peak for defender in MAPS.values()} if self._has_maps else set()
        fooled = self.evidence[GENERAL_RIDE] if self.head_rooms else None
        words = closing(self.findings, self.fits, self.head_rooms, fooled, peaks, self.checks, quick=self.quick)
        return words + [
            f"Contact {contact}. {sentence}"
            for contact, found in self.findings.items()
            for sentence in again_summary(found, self.again[contact])
        ]

    def document(self) -> dict[str, Any]:
        """Plain data for JSON."""
        makers: dict[str, Callable[[], Any]] = {
            "5.2": lambda: document.sways_document(self.evidence),
            "5.4": lambda: document.circles_document(self.evidence),
            "seats": lambda: document.seats_document(self.evidence),
            **{
                number: lambda number=number: document.courses_document(self.evidence, COURSES[number])  # type: ignore[misc]
                for number in COURSES
            },
            "maps": lambda: document.maps_document(self.evidence),
            "claims": lambda: document.claims_document(self.findings),
            "fit": lambda: document.fit_document(self.fits),
            "headroom": lambda: document.head_room_document(self.head_rooms),
        }
        return {
            "chapter": 5,
            "quick": self.quick,
            "parts": {part: makers[part]() for part in self.parts},
            "again": {contact: again_document(found) for contact, found in self.again.items()},
            "regression": document.checks_document(self.checks),
            "closing": self.closing(),
        }

    def figures(self) -> Iterator[tuple[str, Any]]:
        """File names and matplotlib figures of the parts that are figures.

        Raises:
            MissingExtraError: matplotlib is not installed.
        """
        if "5.2" in self.parts:
            yield "figure_5_2", plot_errors.draw_sways(self.evidence)
        if "5.4" in self.parts:
            yield "figure_5_4", plot_errors.draw_circles(self.evidence)
        for number, defenders in COURSES.items():
            if number in self.parts:
                yield f"figure_{number.replace('.', '_')}", plot_courses.draw(self.evidence, number, defenders)
        if "maps" in self.parts:
            for contact in CONTACTS:
                yield f"figures_5_6_to_5_11_{contact}", plot_maps.draw(self.evidence.under(contact))

    @property
    def _has_maps(self) -> bool:
        return bool({"maps", "claims", "fit"} & set(self.parts))


def reproduce_chapter(
    parts: Sequence[str],
    *,
    jobs: int = 1,
    quick: bool = False,
    recheck: bool = False,
    report: Report | None = None,
) -> Reproduction:
    """Simulate what the parts (keys of `parts.PARTS`) need; `recheck` judges the claims under `CONDITIONS` as well.

    `jobs` processes share the work; they are spawned, so a script must guard its main part. `report` is told the share
    of the work done.
    """
    conditions = CONDITIONS if recheck and "claims" in parts else ()
    todo = needed(parts)
    for condition in conditions:
        todo += condition.experiments(behind_claims())
    return Reproduction(tuple(parts), Evidence(compute(todo, jobs, report)), quick, conditions)
