"""Whether learned policies pass their bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from cps_agents.arena.challenge import scores
from cps_agents.arena.meeting import Result
from cps_agents.arena.statistics import Estimate, Strata, difference, estimate
from cps_agents.results.block import Bar, Block, Row, starts_at
from cps_agents.results.examination import Findings

REACHED, ON_AVERAGE, NOT_REACHED, MISSING = "reached", "on average", "not reached", "missing"
VERDICTS = (REACHED, ON_AVERAGE, NOT_REACHED, MISSING)  # from best to worst
ENOUGH_SEEDS = 5  # training seeds without which nothing is reached
TOLERANCE = 1e-9


@dataclass(frozen=True)
class Judgement:
    """A learned policy and one bar."""

    policy: str
    place: int  # of the bar among those of the row
    relation: str  # "above", "at most", ...
    limit: str  # what the policy has to be above or below, in words
    against: str  # the baseline; empty where the limit is a number
    found: Estimate  # the paired difference, or what the policy reached
    margin: float  # of the mean over the limit, negative where it fails
    verdict: str


def strata_of(block: Block, number: int, name: str, metric: str, findings: Findings) -> Strata | None:
    """A metric of a contestant in a row, challenge by challenge; None where it is missing."""
    challenges = range(len(block.rows[number].challenges))
    found = [findings.results.get((block.name, number, place, name)) for place in challenges]
    if any(results is None for results in found):
        return None
    per = block.per_of(block.rows[number], metric)
    return [scores(results, metric, per) for results in found if results is not None]


def simulations_of(block: Block, number: int, name: str, findings: Findings) -> float:
    """Episodes that a contestant simulated for each episode that it played."""
    keys = [(block.name, number, place, name) for place in range(len(block.rows[number].challenges))]
    results: list[Result] = [result for key in keys for result in findings.results.get(key, [])]
    episodes = sum(len(result["metrics"]["return"]) for result in results)
    simulations: int = sum(result.get("simulations", 0) for result in results)
    return simulations / max(episodes, 1)


def judge(block: Block, number: int, findings: Findings) -> list[Judgement]:
    """Every learned policy of a row against every bar that it is for and that can be judged."""
    row = block.rows[number]
    judgements = []
    for each, (place, bar) in product(block.learned, enumerate(block.bars_of(row))):
        if bar.of and each.name not in bar.of:
            continue
        metric = bar.metric or block.metric_of(row)
        learned = strata_of(block, number, each.name, metric, findings)
        if learned is None:
            continue
        if bar.value is not None:
            limit = f"{bar.value:g}{_unit(block, row, bar)}"
            judgements.append(_judgement(each.name, place, bar, block, limit, "", estimate(learned), bar.value))
        for other in block.rivals_of(bar):
            baseline = strata_of(block, number, other, metric, findings)
            if baseline is not None:
                found = difference(learned, baseline, bar.factor, same_seeds=paired(block, each.name, other))
                limit = f"{_times(bar)}{_heading(block, other)}{_unit(block, row, bar)}"
                judgements.append(_judgement(each.name, place, bar, block, limit, other, found, 0.0))
    return judgements


def paired(block: Block, learned: str, other: str) -> bool:
    """Whether the training seeds of two contestants belong together one by one."""
    named = {each.name: each for each in block.contestants}
    return starts_at(named[learned], named[other])


def _judgement(
    policy: str, place: int, bar: Bar, block: Block, limit: str, against: str, found: Estimate, value: float
) -> Judgement:
    margin = (value - found.mean) if wants_less(bar, block) else (found.mean - value)
    verdict = _verdict(found, value, bar, block)
    return Judgement(policy, place, _relation(bar, block), limit, against, found, margin, verdict)


def worst(verdicts: Sequence[str]) -> str:
    """The verdict on everything together."""
    return max(verdicts, key=VERDICTS.index, default=MISSING)


def count_verdicts(verdicts: Sequence[str]) -> Mapping[str, int]:
    """How often each verdict was given, from best to worst."""
    return {name: verdicts.count(name) for name in VERDICTS if name in verdicts}


def wants_less(bar: Bar, block: Block) -> bool:
    """Whether small numbers pass."""
    return block.role == "defender" if bar.less is None else bar.less


def _verdict(found: Estimate, limit: float, bar: Bar, block: Block) -> str:
    less = wants_less(bar, block)
    sign = -1.0 if less else 1.0
    end = found.high if less else found.low

    def passes(value: float) -> bool:
        margin = sign * (value - limit)
        return margin >= -TOLERANCE if bar.or_equal else margin > TOLERANCE

    if not passes(found.mean):
        return NOT_REACHED
    sure = bar.by_mean or (end is not None and passes(end))
    return REACHED if sure and found.seeds >= ENOUGH_SEEDS else ON_AVERAGE


def _relation(bar: Bar, block: Block) -> str:
    if wants_less(bar, block):
        return "at most" if bar.or_equal else "below"
    return "at least" if bar.or_equal else "above"


def _times(bar: Bar) -> str:
    return "" if bar.factor == 1 else f"{bar.factor:g} x "


def _heading(block: Block, name: str) -> str:
    return next(each.heading for each in block.contestants if each.name == name)


def _unit(block: Block, row: Row, bar: Bar) -> str:
    return f" {bar.metric}" if bar.metric and bar.metric != block.metric_of(row) else ""
