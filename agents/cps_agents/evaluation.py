"""Policies beside each other against the same opponents: what each reaches, and paired differences to the bars.

What `cps-envs certify --episodes` has certified about evaluation episodes counts as metrics of these episodes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import compress
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from cps_agents.arena.meeting import Result
from cps_agents.arena.play import Report, play, silent
from cps_agents.arena.statistics import ONE_SEED, Estimate, difference, estimate, interquartile_mean
from cps_agents.arena.store import Store
from cps_agents.arena.table import RETURN, Table, scores
from cps_agents.errors import CommandError
from cps_agents.zoo.references import is_trained
from cps_baselines.workers import Workers
from cps_envs.core.documents import Entry, read_entry
from cps_envs.core.types import FloatArray, Role, other
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
    """Check that a row has what is read from it, as `cps-envs certify --episodes` wrote it."""
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


Known: TypeAlias = Mapping[str, FloatArray]  # metric -> (episodes,) what is known of the episodes besides


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


def compare(
    table: Table, store: Store, workers: int, report: Report = silent, known: Known | None = None
) -> tuple[list[Standing], int]:
    """Play what `store` does not have and judge everything, opponent by opponent; also how many meetings it had."""
    with Workers(workers) as pool:
        played = play([table], store, pool, report=report)
    role: Role = table.judged or "attacker"
    values: dict[str, dict[str, FloatArray]] = {}  # by opponent and policy
    for place, results in played.results.items():
        pair = table.pair(place[1:])
        found = [_with_known(result, table, known or {}) for result in results]
        values.setdefault(pair[other(role)].name, {})[pair[role].name] = scores(found, table.metric, table.per)
    standings = [
        _standing(table, role, rival.name, each.name, values[rival.name])
        for rival in table.players(other(role))
        for each in table.players(role)
    ]
    return standings, played.reused


def _with_known(result: Result, table: Table, known: Known) -> Result:
    """A result with what is known of its episodes; those count for which there is something to divide by."""
    if not known:
        return result
    metrics = {**result["metrics"], **{name: values.tolist() for name, values in known.items()}}
    kept = [not table.per or value != 0 for value in metrics[table.per or table.metric]]
    return {**result, "metrics": {name: list(compress(values, kept)) for name, values in metrics.items()}}


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
