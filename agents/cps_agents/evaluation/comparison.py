"""Policies beside each other in the same arena: what each reaches, and paired differences to the baselines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import compress
from typing import Any

from cps_agents.benchmark.cell import Cell, Result
from cps_agents.benchmark.runner import attempt
from cps_agents.evaluation.arena import Arena, scores
from cps_agents.evaluation.statistics import ONE_SEED, Estimate, difference, estimate, interquartile_mean
from cps_agents.zoo.references import is_trained
from cps_baselines.workers import Workers
from cps_envs.core.types import FloatArray, Role

Report = Callable[[int, str], None]  # pieces of work done, the last one


@dataclass(frozen=True)
class Standing:
    """What a policy reached against an opponent."""

    opponent: str
    policy: str
    is_baseline: bool
    mean: Estimate
    iqm: Estimate
    differences: Mapping[str, Estimate]  # to each baseline, policy minus baseline
    cautions: Mapping[str, str]  # what the interval of a difference leaves out, by baseline
    values: FloatArray  # (training seeds, episodes)

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return {
            "opponent": self.opponent,
            "policy": self.policy,
            "baseline": self.is_baseline,
            **asdict(self.mean),
            "iqm": {"mean": self.iqm.mean, "low": self.iqm.low, "high": self.iqm.high},
            "differences": {
                name: {
                    **asdict(found),
                    "excludes_zero": found.excludes_zero,
                    "caution": self.cautions.get(name, ""),
                }
                for name, found in self.differences.items()
            },
            "values": self.values.tolist(),
        }


@dataclass(frozen=True)
class Comparison:
    """What is to be compared."""

    arenas: Sequence[Arena]  # one for each opponent
    policies: Sequence[str]
    baselines: Sequence[str]
    metric: str
    per: str = ""  # a metric of the same episode that the other one is divided by
    known: Mapping[str, FloatArray] = field(default_factory=dict)  # (episodes,) what is known of them besides

    def jobs(self) -> dict[tuple[int, str], list[Cell]]:
        """The work for each arena's number and policy."""
        names = dict.fromkeys((*self.policies, *self.baselines))
        return {(place, name): arena.cells(name) for place, arena in enumerate(self.arenas) for name in names}


def compare(comparison: Comparison, workers: int, report: Report = lambda done, label: None) -> list[Standing]:
    """Play everything and judge it, opponent by opponent, policies before baselines."""
    jobs = comparison.jobs()
    cells = [cell for group in jobs.values() for cell in group]
    finished: dict[int, Result] = {}
    with Workers(workers) as pool:
        for cell, result in pool.run(attempt, cells):
            finished[id(cell)] = result
            report(len(finished), cell.label.removeprefix(f"{cell.problem} "))
    values = {
        key: scores([_with_known(finished[id(cell)], comparison) for cell in group], comparison.metric, comparison.per)
        for key, group in jobs.items()
    }
    return [
        _standing(comparison, place, name, values)
        for place in range(len(comparison.arenas))
        for name in dict.fromkeys((*comparison.policies, *comparison.baselines))
    ]


def _with_known(result: Result, comparison: Comparison) -> Result:
    """A result with what is known of its episodes; those count for which there is something to divide by."""
    if not comparison.known:
        return result
    metrics = {**result["metrics"], **{name: values.tolist() for name, values in comparison.known.items()}}
    kept = [not comparison.per or value != 0 for value in metrics[comparison.per or comparison.metric]]
    return {**result, "metrics": {name: list(compress(values, kept)) for name, values in metrics.items()}}


def _standing(comparison: Comparison, place: int, name: str, values: Mapping[tuple[int, str], FloatArray]) -> Standing:
    mine = values[place, name]
    others = [baseline for baseline in comparison.baselines if baseline != name] if name in comparison.policies else []
    return Standing(
        opponent=comparison.arenas[place].opponent,
        policy=name,
        is_baseline=name not in comparison.policies,
        mean=estimate([mine]),
        iqm=estimate([mine], interquartile_mean),
        differences={other: difference([mine], [values[place, other]]) for other in others},
        cautions={other: text for other in others if (text := caution(other, values[place, other]))},
        values=mine,
    )


def caution(reference: str, values: FloatArray) -> str:
    """What the interval of a difference to a baseline with these values (training seeds, episodes) leaves out."""
    return ONE_SEED if is_trained(reference) and len(values) == 1 else ""


def is_better(found: Estimate, role: Role) -> bool | None:
    """Whether a difference of what the attacker is paid is to the role's advantage; None where zero is not excluded."""
    if not found.excludes_zero:
        return None
    return (found.mean > 0) == (role == "attacker")
