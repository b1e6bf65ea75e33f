"""A chapter as data, and what was computed of it: tables, words, plain data and figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Generic

from cps_agents.workers import Where
from cps_envs.core.errors import ConfigurationError, near
from cps_paper.claims import (
    Claims,
    ClaimTally,
    Findings,
    findings_document,
    findings_summary,
    findings_table,
    tally_claims,
)
from cps_paper.evidence import Experiment, Report, compute
from cps_paper.exhibit import E, Exhibit, ExhibitTable
from cps_paper.recheck import Again, Condition, again_document, again_summary, judge_again, recheck_document, with_again
from cps_paper.verdicts import Check

CLAIMS = "claims"  # the exhibit with everything that the text claims


@dataclass(frozen=True)
class Judged(Generic[E]):
    """The claims of a chapter, and how they are judged."""

    claims: Claims[E]
    rules: str
    experiments: Callable[[E], Iterable[Experiment[Any]]]
    conditions: Sequence[Condition] = ()  # under which --recheck judges them again
    readings: Callable[[E], Mapping[str, E]] = lambda evidence: {"": evidence}  # several are judged side by side

    @property
    def exhibit(self) -> Exhibit[E]:
        """The claims as a part that can be asked for; `Reproduction` makes its table."""
        return Exhibit(CLAIMS, "everything that the text claims, one by one", self.experiments, lambda evidence: ())


@dataclass(frozen=True)
class Chapter(Generic[E]):
    """What can be asked for and what is said of it."""

    title: str  # "chapter 2"
    evidence: Callable[..., E]  # the evidence without results, from `quick` and the options of its command
    reading: Callable[[E], str]  # how the text was read, such as "interpretation S0"
    exhibits: Sequence[Exhibit[E]]
    closing: Callable[[Reproduction[E]], list[str]]  # what is not reproduced, and why
    document: Callable[[Reproduction[E]], dict[str, Any]]  # for JSON
    checks: Callable[[Reproduction[E]], Sequence[Check]]  # the regression check
    judged: Judged[E] | None = None
    tallies: Callable[[Reproduction[E]], list[ClaimTally]] = lambda found: []  # of what is no claim
    always: Callable[[E], Iterable[Experiment[Any]]] = lambda evidence: ()  # whatever is asked for

    @property
    def parts(self) -> dict[str, str]:
        """What can be asked for, in words."""
        return {each.name: each.about for each in self.exhibits if each.given is None}

    def chosen(
        self, parts: Iterable[str] = (), *, quick: bool = False, recheck: bool = False, option: str = "--table"
    ) -> tuple[str, ...]:
        """The parts asked for in their usual order; all of them, or with `quick` the quick ones, if none is named.

        `option` is what names them on the command line.

        Raises:
            ConfigurationError: a part that does not exist, or `recheck` without claims.
        """
        wanted, known = list(parts), self.parts
        for part in wanted:
            if part not in known:
                raise ConfigurationError(
                    f"{self.title} has no part {part!r}. {near(part, known)} Known: {', '.join(known)}."
                )
        usual = [each.name for each in self.exhibits if each.quick or not quick]
        found = tuple(name for name in known if name in (wanted or usual))
        if recheck and self.judged and CLAIMS not in found:
            raise ConfigurationError(f"--recheck judges claims again, and none are judged: add {option} {CLAIMS}.")
        return found

    def shown(self, parts: Sequence[str], evidence: E) -> list[Exhibit[E]]:
        """The exhibits asked for and those that follow, in their usual order."""
        return [each for each in self.exhibits if (each.given(evidence) if each.given else each.name in parts)]

    def needed(self, parts: Sequence[str], evidence: E, conditions: Sequence[Condition] = ()) -> list[Experiment[Any]]:
        """The experiments behind these parts, some twice, and behind the claims under other conditions."""
        todo = list(self.always(evidence))
        for each in self.shown(parts, evidence):
            todo += each.experiments(evidence)
        for condition in conditions if self.judged else ():
            todo += condition.experiments(self.judged.experiments(evidence) if self.judged else ())
        return todo

    def reproduce(
        self,
        parts: Iterable[str] = (),
        *,
        quick: bool = False,
        recheck: bool = False,
        jobs: Where = 1,
        report: Report | None = None,
        **reading: Any,
    ) -> Reproduction[E]:
        """Compute what the parts need (all if none is named); `recheck` judges the claims under other conditions too.

        `jobs` processes share the work, or a cluster does. Processes are spawned, so a script must guard its main part.
        `report` is told the share of the work done. `reading` are the options of the chapter.

        Raises:
            ConfigurationError: see `chosen`; or an option that the chapter refuses.
        """
        found = self.chosen(parts, quick=quick, recheck=recheck)
        evidence = self.evidence(quick=quick, **reading)
        conditions = self.judged.conditions if self.judged and recheck else ()
        todo = map(evidence.vary, self.needed(found, evidence, conditions))
        return Reproduction(self, found, replace(evidence, results=compute(todo, jobs, report)), conditions)


@dataclass(frozen=True)
class Reproduction(Generic[E]):
    """Parts of a chapter, computed."""

    chapter: Chapter[E]
    parts: Sequence[str]
    evidence: E
    conditions: Sequence[Condition] = ()  # under which the claims are judged again

    @property
    def reading(self) -> str:
        """How the text was read."""
        return self.chapter.reading(self.evidence)

    @property
    def exhibits(self) -> list[Exhibit[E]]:
        """Those asked for and those that follow."""
        return self.chapter.shown(self.parts, self.evidence)

    @cached_property
    def findings(self) -> dict[str, Findings]:
        """All claims by reading, if asked for; where a verdict changes when judged again, it says so."""
        judged = self.chapter.judged
        if judged is None or CLAIMS not in self.parts:
            return {}
        views = judged.readings(self.evidence)
        return {
            name: with_again(judged.claims.evaluate(view), again)
            for (name, view), again in zip(views.items(), self.again.values(), strict=True)
        }

    @cached_property
    def again(self) -> dict[str, list[Again]]:
        """The verdicts under other conditions, by reading."""
        judged = self.chapter.judged
        if judged is None:
            return {}
        views = judged.readings(self.evidence)
        return {name: judge_again(view, self.conditions, judged.claims.evaluate) for name, view in views.items()}

    @cached_property
    def checks(self) -> Sequence[Check]:
        """Our numbers beside those of our second implementation."""
        return self.chapter.checks(self)

    @property
    def passed(self) -> bool:
        """Whether our own numbers are still those of the reference; what differs from the paper does not count."""
        return all(each.passed for each in self.checks)

    def tallies(self) -> list[ClaimTally]:
        """How many statements got which verdict."""
        claims = [
            tally_claims(" ".join(filter(None, (self.reading, name))), each) for name, each in self.findings.items()
        ]
        return claims + self.chapter.tallies(self)

    def tables(self) -> list[ExhibitTable]:
        """For readers."""
        return [table for each in self.exhibits for table in self.tables_of(each)]

    def sheets(self) -> Iterator[tuple[str, str]]:
        """File names without suffix, and the tables as comma-separated values."""
        for each in self.exhibits:
            for k, table in enumerate(self.tables_of(each), 1):
                yield f"{each.name}-{k}", table.sheet.csv

    def closing(self) -> list[str]:
        """Paragraphs that say what is not reproduced, and why."""
        again = [
            f"{self._named(name)}{sentence}"
            for name, each in self.findings.items()
            for sentence in again_summary(each, self.again[name])
        ]
        return self.chapter.closing(self) + again

    def claims_summary(self) -> list[str]:
        """A sentence on the claims under each reading, if they were asked for."""
        return [f"{self._named(name)}{findings_summary(each)}" for name, each in self.findings.items()]

    def document(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return self.chapter.document(self)

    def data(self) -> dict[str, Any]:
        """Every part asked for, for JSON."""
        return {each.name: self._data(each) for each in self.exhibits if each.given is None}

    def again_data(self) -> Any:
        """Counts of verdicts under other conditions, for JSON."""
        found = {name: again_document(each) for name, each in self.again.items()}
        return found.get("", found)

    def rechecks(self) -> list[dict[str, Any]]:
        """What became of the verdicts under each condition, by reading; empty without --recheck."""
        return [
            {"reading": " ".join(filter(None, (self.reading, name))), **recheck_document(self.findings[name], each)}
            for name, every in self.again.items()
            for each in every
        ]

    def figures(self) -> Iterator[tuple[str, Any]]:
        """File names without suffix, and matplotlib figures.

        Raises:
            MissingExtraError: matplotlib is not installed.
        """
        for each in self.exhibits:
            for name, draw in each.figures.items():
                yield name, draw(self.evidence)

    def tables_of(self, exhibit: Exhibit[E]) -> Sequence[ExhibitTable]:
        """Those of one part, for readers."""
        judged = self.chapter.judged
        if judged is not None and exhibit.name == CLAIMS:
            return [findings_table(self.findings, judged.rules)]
        return exhibit.tables(self.evidence)

    def _data(self, exhibit: Exhibit[E]) -> Any:
        if exhibit.name != CLAIMS:
            return exhibit.data(self.evidence)
        found = {name: findings_document(each) for name, each in self.findings.items()}
        return found.get("", found)

    def _named(self, reading: str) -> str:
        return f"{self.reading.capitalize()} {reading}. " if reading else ""
