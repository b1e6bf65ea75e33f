"""Policies beside each other in the same challenges: what each reaches, and paired differences to the baselines.

What `cps-envs certify --episodes` has certified about evaluation episodes counts as metrics of these episodes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from cps_agents.arena.challenge import Challenge, scores
from cps_agents.arena.meeting import Result
from cps_agents.arena.play import Pairing, Report, play, silent
from cps_agents.arena.statistics import ONE_SEED, Estimate, difference, estimate, interquartile_mean
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_agents.zoo.references import is_trained
from cps_baselines.arena import Contestant
from cps_baselines.workers import Workers
from cps_envs.core.documents import Entry, read_entry
from cps_envs.core.types import FloatArray, Role
from cps_envs.fdi.optima import FASTEST_MPS, PROVED, ROUNDING_MPS, STATUSES


def stored_episodes(path: Path, config: Any) -> dict[str, Any]:
    """The certified episodes of a file, by seed; none where there is no file.

    Raises:
        DamagedFileError: it holds something else.
        CommandError: it holds episodes of another configuration.
    """
    if not path.exists():
        return {}
    document = read_entry(path, "file of certified episodes", "Name another file with --out, or delete it.")
    same, rows = document["config"].value == plain_values(config), document["episodes"].entries()
    if not same:
        raise CommandError(
            f"{path} holds episodes of another configuration. Name another file with --out, or delete it."
        )
    for row in rows.values():
        _check(row)
    return document["episodes"].plain()


def certified_metrics(path: Path, config: Any, episodes: int) -> Mapping[str, FloatArray]:
    """Bound and best known value (m/s) of the evaluation episodes, and 1 where an attack is proved optimal.

    Each is (episodes,); the value is 0 where no attack is known.

    Raises:
        CommandError: the file does not have them all.
    """
    rows = stored_episodes(path, config)
    if missing := [seed for seed in range(episodes) if str(seed) not in rows]:
        raise CommandError(
            f"{path} lacks {len(missing)} of {episodes} episodes: certify them with `cps-envs certify --episodes "
            f"{episodes} --out {path}`, with the same preset and settings."
        )
    chosen = [rows[str(seed)] for seed in range(episodes)]
    return {
        "oracle_bound_mps": np.array([row["bound_mps"] for row in chosen]),
        "oracle_value_mps": np.array([row["value_mps"] or 0.0 for row in chosen]),
        "optimum_proved": np.array([float(row["status"] == PROVED) for row in chosen]),
    }


def _check(row: Entry) -> None:
    """That a row has what is read from it, as `cps-envs certify --episodes` wrote it."""
    row["task"].text()
    row["status"].text(STATUSES)
    row["wall_s"].number(0)
    bound_mps = row["bound_mps"].number(0, FASTEST_MPS)
    if row["value_mps"].value is not None:
        row["value_mps"].number(0, bound_mps + ROUNDING_MPS)
    if row["lp_mps"].value is not None:
        row["lp_mps"].number(0, FASTEST_MPS)
    for gain in row["gains"].rows():
        gain.number()


def plain_values(config: Any) -> Any:
    """A configuration as the file has it."""
    return json.loads(json.dumps(asdict(config)))


Place = tuple[int, str]  # number of the challenge, policy


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
    worst_seed: float | None  # the mean of the worst of several training seeds

    @property
    def hides_its_worst(self) -> bool:
        """Whether the worst training seed lies outside the interval of the mean."""
        low, high = self.mean.low, self.mean.high
        return None not in (self.worst_seed, low, high) and not low <= self.worst_seed <= high  # type: ignore[operator]

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
            "worst_seed": self.worst_seed,
            "hides_its_worst": self.hides_its_worst,
            "values": self.values.tolist(),
        }


@dataclass(frozen=True)
class Comparison:
    """What an evaluation compares: policies and baselines, against which opponents, by which metric."""

    challenges: Sequence[Challenge]  # one for each opponent
    policies: Sequence[str]
    baselines: Sequence[str]
    metric: str
    per: str = ""  # a metric of the same episode that the other one is divided by
    known: Mapping[str, FloatArray] = field(default_factory=dict)  # (episodes,) what is known of them besides

    @property
    def names(self) -> list[str]:
        """Policies before baselines."""
        return list(dict.fromkeys((*self.policies, *self.baselines)))

    def pairings(self) -> dict[Place, Pairing]:
        """Who meets whom."""
        return {
            (number, name): challenge.pairing(Contestant(name))
            for number, challenge in enumerate(self.challenges)
            for name in self.names
        }


def compare(comparison: Comparison, store: Store, workers: int, report: Report = silent) -> tuple[list[Standing], int]:
    """Play what `store` does not have and judge everything, opponent by opponent; also how many meetings it had."""
    with Workers(workers) as pool:
        played = play(comparison.pairings(), store, pool, report=report)
    values = {
        place: scores([_with_known(result, comparison) for result in results], comparison.metric, comparison.per)
        for place, results in played.results.items()
    }
    standings = [
        _standing(comparison, number, name, values)
        for number in range(len(comparison.challenges))
        for name in comparison.names
    ]
    return standings, played.reused


def _with_known(result: Result, comparison: Comparison) -> Result:
    """A result with what is known of its episodes; those count for which there is something to divide by."""
    if not comparison.known:
        return result
    metrics = {**result["metrics"], **{name: values.tolist() for name, values in comparison.known.items()}}
    kept = [not comparison.per or value != 0 for value in metrics[comparison.per or comparison.metric]]
    return {**result, "metrics": {name: list(compress(values, kept)) for name, values in metrics.items()}}


def _standing(comparison: Comparison, place: int, name: str, values: Mapping[Place, FloatArray]) -> Standing:
    mine = values[place, name]
    others = [baseline for baseline in comparison.baselines if baseline != name] if name in comparison.policies else []
    return Standing(
        opponent=comparison.challenges[place].opponent,
        policy=name,
        is_baseline=name not in comparison.policies,
        mean=estimate([mine]),
        iqm=estimate([mine], interquartile_mean),
        differences={other: difference([mine], [values[place, other]]) for other in others},
        cautions={other: text for other in others if (text := caution(other, values[place, other]))},
        values=mine,
        worst_seed=worst_of(mine, comparison.challenges[place].role),
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
