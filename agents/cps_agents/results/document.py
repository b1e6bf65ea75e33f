"""The findings as one JSON document, from which every table is written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cps_agents.arena.challenge import Challenge
from cps_agents.arena.statistics import ONE_SEED, Estimate, difference, estimate
from cps_agents.results.block import Block, trained_teacher_of
from cps_agents.results.examination import Findings, missing_of
from cps_agents.results.judging import judge, paired, simulations_of, strata_of, worst
from cps_agents.zoo.references import by_training_seed, card_of, is_missing, is_trained
from cps_baselines.arena import Contestant

Document = dict[str, Any]
FORMAT = 2


def document(blocks: Sequence[Block], findings: Findings, machine: Mapping[str, Any], quick: bool) -> Document:
    """Everything, sorted by problem; `machine` tells command, processor and versions."""
    names = list(dict.fromkeys(block.problem for block in blocks))
    problems = {
        name: {"blocks": [{**_block(block, findings), **machine} for block in blocks if block.problem == name]}
        for name in names
    }
    return {"format": FORMAT, "quick": quick, "problems": problems}


def merged(before: Document | None, new: Document, declared: Mapping[str, Sequence[str]]) -> Document:
    """`new` with the blocks that only the earlier document has, of those that the problems declare."""
    kept = before["problems"] if before and before.get("format") == FORMAT else {}
    known = {
        (name, block["name"]): block
        for problems in (kept, new["problems"])
        for name, problem in problems.items()
        for block in problem["blocks"]
    }
    found = {
        name: [known[name, block] for block in blocks if (name, block) in known] for name, blocks in declared.items()
    }
    return {**new, "problems": {name: {"blocks": blocks} for name, blocks in found.items() if blocks}}


def _block(block: Block, findings: Findings) -> Document:
    missing = missing_of(block)
    return {
        "name": block.name,
        "title": block.title,
        "target": block.target,
        "role": block.role,
        "metric": block.metric,
        "per": block.per,
        "form": block.form,
        "unit": block.unit,
        "shown": list(block.shown),
        "notes": list(block.notes),
        "missing": missing,
        "learned": [_contestant(each, each.name in missing) for each in block.learned],
        "baselines": [_baseline(each) for each in block.baselines],
        "left_out": dict(block.left_out),
        "rows": [_row(block, number, findings) for number in range(len(block.rows))],
    }


def _contestant(each: Contestant, missing: bool) -> Document:
    card = None if missing else card_of(each.reference)
    facts: Document = {"name": each.name, "title": each.heading, "policy": each.reference, "missing": missing}
    if card is not None:
        trained = [seed.get("cpu_s") for seed in card.seeds.values()]
        facts |= {"algorithm": card.algorithm, "opponent": card.opponent, "training_seeds": list(card.seeds)}
        facts |= {"training": card.command, "cpu_s": [value for value in trained if value is not None]}
    return facts


def _baseline(each: Contestant) -> Document:
    alone = is_trained(each.reference) and not is_missing(each.reference) and len(by_training_seed(each.reference)) == 1
    plain = {"name": each.name, "title": each.heading, "policy": each.reference, "optimum": each.optimum}
    return {**plain, "caution": ONE_SEED if alone else ""}


def _row(block: Block, number: int, findings: Findings) -> Document:
    row = block.rows[number]
    metric = block.metric_of(row)
    contestants = {each.name: _score(block, number, each.name, metric, findings) for each in block.contestants}
    judgements = judge(block, number, findings)
    verdicts = {
        each.name: worst([judgement.verdict for judgement in judgements if judgement.policy == each.name])
        for each in block.learned
        if any(not bar.of or each.name in bar.of for bar in block.bars_of(row))
    }
    return {
        "title": row.title,
        "metric": metric,
        "bound": row.bound,
        "best_known": row.best_known,
        "shares": _shares(block, number, findings),
        "headline": row.headline,
        "arenas": [_challenge(challenge) for challenge in row.challenges],
        "found": _found(block, number, findings),
        "scores": {name: score for name, score in contestants.items() if score is not None},
        "judgements": [
            {name: getattr(each, name) for name in ("policy", "place", "relation", "limit", "against", "verdict")}
            | {"margin": _rounded(each.margin), **_numbers(each.found)}
            for each in judgements
        ],
        "differences": _differences(block, number, metric, findings),
        "verdicts": verdicts,
    }


def _challenge(challenge: Challenge) -> str:
    venue = challenge.venue
    where = [venue.problem, venue.preset, *(f"{name}={value}" for name, value in venue.overrides.items())]
    return f"{' '.join(where)}, against {challenge.opponent}, episodes: {challenge.episodes}"


def _found(block: Block, number: int, findings: Findings) -> Document:
    """What contestants found out before they played, by name."""
    here = {at[3]: found["note"] for (at, _), found in findings.prepared.items() if at[:2] == (block.name, number)}
    return {name: note for name, note in here.items() if len(block.rows[number].challenges) == 1}


def _score(block: Block, number: int, name: str, metric: str, findings: Findings) -> Document | None:
    strata = strata_of(block, number, name, metric, findings)
    if strata is None:
        return None
    shown = {
        other: float(np.mean([values.mean() for values in strata_of(block, number, name, other, findings) or ()]))
        for other in block.shown
    }
    score = {**_numbers(estimate(strata)), "shown": shown}
    simulations = simulations_of(block, number, name, findings)
    return score | ({"simulations": simulations} if simulations else {})


def _shares(block: Block, number: int, findings: Findings) -> dict[str, float]:
    """Of the best known that each learned policy reached in the mean."""
    best = block.rows[number].best_known
    if not best:
        return {}
    metric = block.metric_of(block.rows[number])
    found = {each.name: strata_of(block, number, each.name, metric, findings) for each in block.learned}
    return {name: _rounded(estimate(strata).mean / best) for name, strata in found.items() if strata is not None}


def _differences(block: Block, number: int, metric: str, findings: Findings) -> Document:
    """Paired differences of each learned policy to every baseline, and to the trained policy that it learned from."""
    found: Document = {}
    for each in block.learned:
        learned = strata_of(block, number, each.name, metric, findings)
        teachers = [other for other in block.learned if other is trained_teacher_of(block, each)]
        for other in (*block.baselines, *teachers) if learned is not None else ():
            baseline = strata_of(block, number, other.name, metric, findings)
            if learned is not None and baseline is not None:
                same = paired(block, each.name, other.name)
                found.setdefault(each.name, {})[other.name] = _numbers(difference(learned, baseline, same_seeds=same))
    return found


def _numbers(found: Estimate) -> Document:
    """Rounded to seven digits, so that a machine's last bits do not change the files."""
    values = {name: _rounded(value) for name, value in asdict(found).items()}
    return {**values, "excludes_zero": found.excludes_zero}


def _rounded(value: Any) -> Any:
    return float(f"{value:.7g}") if isinstance(value, float) else value
