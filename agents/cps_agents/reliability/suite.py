"""Doing the chunks of the chosen parts within a time, and adding up what is known."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from cps_agents.reliability.child import run_chunk
from cps_agents.reliability.chunk import Chunk, Part, Result
from cps_agents.reliability.store import Store

Report = Callable[[int, int, str], None]  # chunks known, chunks in all, the last one
Work = Callable[[Chunk], Result]


@dataclass
class Findings:
    """What is known of a part: its finished chunks, in order."""

    part: Part
    chunks: int  # in all
    results: list[Result] = field(default_factory=list)

    @property
    def rows(self) -> dict[str, dict[str, float]]:
        """The sums of each row of the table."""
        table: dict[str, dict[str, float]] = {}
        for result in self.results:
            row = table.setdefault(result["row"], dict.fromkeys(self.part.columns, 0))
            for name, count in result["counts"].items():
                row[name] = row.get(name, 0) + count
        return table

    @property
    def totals(self) -> dict[str, float]:
        """The sums of the rows."""
        return {name: sum(row.get(name, 0) for row in self.rows.values()) for name in self.part.columns}

    @property
    def violations(self) -> dict[str, float]:
        """Counts that should be zero and are not."""
        return {name: count for name, count in self.totals.items() if name in self.part.forbidden and count}

    @property
    def examples(self) -> list[str]:
        """One counterexample for each forbidden column of each chunk, and other remarks."""
        found = [f"{kind}: {text}" for result in self.results for kind, text in result.get("examples", {}).items()]
        return list(dict.fromkeys(found))


def run_parts(
    parts: Sequence[Part], store: Store, minutes: float, report: Report | None = None, work: Work = run_chunk
) -> list[Findings]:
    """Do what `store` does not know, each part in its share of the time, which what it leaves over is added to.

    The last chunk of a part is finished when its time is over, so that every part gets something done.
    """
    end = time.monotonic() + 60 * minutes
    plans = [list(part.chunks()) for part in parts]
    total, done, found = sum(map(len, plans)), 0, []
    for place, (part, chunks) in enumerate(zip(parts, plans, strict=True)):
        now = time.monotonic()
        share = now + (end - now) / (len(parts) - place)
        findings = Findings(part, len(chunks))
        for chunk, result in _finish(chunks, store, share, work):
            findings.results.append(result)
            done += 1
            if report is not None:
                report(done, total, f"{part.name}: {chunk.row}")
        found.append(findings)
    return found


def _finish(chunks: Sequence[Chunk], store: Store, until: float, work: Work) -> Iterator[tuple[Chunk, Result]]:
    """Known results first; then new ones, until the time is over."""
    left = []
    for chunk in chunks:
        known = store.get(chunk)
        if known is None:
            left.append(chunk)
        else:
            yield chunk, known
    for chunk in left:
        if time.monotonic() >= until:
            return
        yield chunk, store.put(chunk, work(chunk))
