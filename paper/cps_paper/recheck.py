"""Judging the claims again under other conditions: does a verdict depend on a choice of ours?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from cps_paper.claims import Findings
from cps_paper.evidence import Evidence, Experiment, Vary
from cps_paper.verdicts import UNKNOWN, VERDICTS

E = TypeVar("E", bound=Evidence)
V = TypeVar("V")


def varying(kind: type[V], vary: Callable[[V], Any]) -> Vary:
    """Only experiments of this kind can stand behind a claim; another one is a TypeError."""

    def other(experiment: Experiment[Any]) -> Experiment[Any]:
        if not isinstance(experiment, kind):
            raise TypeError(f"no claim needs {experiment.label}")
        found: Experiment[Any] = vary(experiment)
        return found

    return other


@dataclass(frozen=True)
class Condition:
    """Something that is chosen, and chosen otherwise."""

    name: str  # "at half the step"
    variants: tuple[Vary, ...]  # each gives the experiment that stands in for one of the chapter

    def experiments(self, todo: Iterable[Experiment[Any]]) -> list[Experiment[Any]]:
        """What has to be computed to judge the claims behind these experiments."""
        every = list(todo)
        return [vary(each) for vary in self.variants for each in every]


@dataclass(frozen=True)
class Again:
    """How often each claim got which verdict under a condition."""

    condition: str
    counts: Mapping[str, Mapping[str, int]]  # by id of the claim

    def differs(self, name: str, verdict: str) -> bool:
        """Whether a claim with this verdict got another one here."""
        return set(self.counts[name]) - {verdict} != set()

    def shown(self, name: str) -> str:
        """The verdicts of a claim, the most frequent first."""
        counts = self.counts[name]
        if sum(counts.values()) == 1:
            return f"{self.condition}: {next(iter(counts))}"
        words = sorted(counts, key=lambda word: (-counts[word], VERDICTS.index(word)))
        return f"{self.condition}: {', '.join(f'{counts[word]} {word}' for word in words)}"


def judge_again(evidence: E, conditions: Sequence[Condition], evaluate: Callable[[E], Findings]) -> list[Again]:
    """The verdicts under each condition; `evaluate` judges the claims by some evidence."""
    found = []
    for condition in conditions:
        counts: dict[str, Counter[str]] = {}
        for vary in condition.variants:
            for claim, finding in evaluate(evidence.varied(vary)):
                counts.setdefault(claim.id, Counter())[finding.verdict] += 1
        found.append(Again(condition.name, counts))
    return found


def with_again(findings: Findings, again: Sequence[Again]) -> Findings:
    """The findings, where a verdict that changes says so."""
    return [
        (claim, replace(finding, shown="; ".join((finding.shown, *_changes(claim.id, finding.verdict, again)))))
        for claim, finding in findings
    ]


def again_summary(findings: Findings, again: Sequence[Again]) -> list[str]:
    """A sentence on each condition: which verdicts change, and to what."""
    return [_summary(findings, each) for each in again]


def again_document(again: Sequence[Again]) -> dict[str, Any]:
    """The counts of verdicts by condition and claim, for JSON."""
    return {each.condition: {name: dict(counts) for name, counts in each.counts.items()} for each in again}


def recheck_document(findings: Findings, again: Again) -> dict[str, Any]:
    """Under one condition: how many claims were judged, and what became of those whose verdict changes; for JSON."""
    judged = [(claim.id, finding.verdict) for claim, finding in findings if finding.verdict != UNKNOWN]
    changed = {
        name: again.shown(name).removeprefix(f"{again.condition}: ")
        for name, verdict in judged
        if again.differs(name, verdict)
    }
    return {"condition": again.condition, "judged": len(judged), "changed": changed}


def _summary(findings: Findings, again: Again) -> str:
    found = recheck_document(findings, again)
    judged, changed = found["judged"], found["changed"]
    start = f"Judged again {again.condition}: {judged - len(changed)} of {judged} verdicts stay"
    return f"{start}. Changed: {_listed(changed)}." if changed else f"{start}."


def _listed(changed: Mapping[str, str]) -> str:
    return "; ".join(f"{name} {shown}" for name, shown in changed.items())


def _changes(name: str, verdict: str, again: Sequence[Again]) -> list[str]:
    return [each.shown(name) for each in again if each.differs(name, verdict)]
