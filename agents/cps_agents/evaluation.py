"""Policies beside each other against the same opponents: what each reaches, and paired differences to the bars."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from cps_agents.arena.play import Report, play, silent
from cps_agents.arena.statistics import ONE_SEED, Estimate, difference, estimate, interquartile_mean
from cps_agents.arena.store import Store
from cps_agents.arena.table import RETURN, Table, scores
from cps_agents.workers import Where, Workers
from cps_agents.zoo.references import is_trained
from cps_envs.core.types import FloatArray, Role, other


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
    worst_seed: float | None  # the mean of the worst of several training seeds; None of a metric that is no pay

    @property
    def hides_its_worst(self) -> bool:
        """Whether the worst training seed lies outside the interval of the mean."""
        low, high = self.mean.low, self.mean.high
        return None not in (self.worst_seed, low, high) and not low <= self.worst_seed <= high  # type: ignore[operator]

    def to_json(self) -> dict[str, Any]:
        """The table as plain data."""
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
            "worst_seed": self.worst_seed,
            "hides_its_worst": self.hides_its_worst,
            "values": self.values.tolist(),
        }


def compare(table: Table, store: Store, workers: Where, report: Report = silent) -> list[Standing]:
    """Play what `store` does not have and judge everything, opponent by opponent."""
    with Workers(workers) as pool:
        played = play([table], store, pool, report=report)
    role: Role = table.judged or "attacker"
    values: dict[str, dict[str, FloatArray]] = {}  # by opponent and policy
    for place, results in played.results.items():
        pair = table.pair(place[1:])
        values.setdefault(pair[other(role)].name, {})[pair[role].name] = scores(results, table.metric, table.per)
    return [
        _standing(table, role, rival.name, each.name, values[rival.name])
        for rival in table.players(other(role))
        for each in table.players(role)
    ]


def _standing(table: Table, role: Role, opponent: str, name: str, values: Mapping[str, FloatArray]) -> Standing:
    mine = values[name]
    judged = name in {each.name for each in (table.attackers if role == "attacker" else table.defenders)}
    others = [each.name for each in table.bars if each.name != name] if judged else []
    return Standing(
        opponent=opponent,
        policy=name,
        is_baseline=not judged,
        mean=estimate([mine]),
        iqm=estimate([mine], interquartile_mean),
        differences={other: difference([mine], [values[other]]) for other in others},
        cautions={other: text for other in others if (text := caution(other, values[other]))},
        values=mine,
        worst_seed=worst_of(mine, role) if table.metric == RETURN else None,
    )


def worst_of(values: FloatArray, role: Role) -> float | None:
    """The mean of the worst training seed for a role, of what the attacker is paid (seeds, episodes); None of one."""
    means = values.mean(axis=1)
    return None if len(means) < 2 else float(means.min() if role == "attacker" else means.max())


def caution(reference: str, values: FloatArray) -> str:
    """What the interval of a difference to a baseline with these values (training seeds, episodes) leaves out."""
    return ONE_SEED if is_trained(reference) and len(values) == 1 else ""


def is_better(found: Estimate, role: Role) -> bool | None:
    """Whether a difference of what the attacker is paid is to the role's advantage; None where zero is not excluded."""
    if not found.excludes_zero:
        return None
    return (found.mean > 0) == (role == "attacker")
