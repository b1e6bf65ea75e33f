"""Everybody against everybody: what each pair's episodes paid, from what was played before and what is played now."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from cps_agents.arena.meeting import make_meeting
from cps_agents.arena.play import Pairing, Report, play, silent
from cps_agents.arena.store import Store
from cps_agents.errors import CommandError
from cps_baselines.arena import Contestant, Venue
from cps_baselines.workers import Workers
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.types import FloatArray, Role

RETURN = "return"  # the attacker's payoff


@dataclass(frozen=True)
class Payoffs:
    """m attackers against n defenders in E episodes, the same seeds for every pair."""

    values: FloatArray  # (m, n, E)
    cpu_s: FloatArray  # (m, n)
    reused: int  # pairs that had played before

    @property
    def means(self) -> FloatArray:
        """The matrix (m, n)."""
        found: FloatArray = self.values.mean(axis=2)
        return found


def play_meetings(
    venue: Venue,
    attackers: Sequence[Contestant],
    defenders: Sequence[Contestant],
    seeds: range,
    *,
    store: Store,
    pool: Workers,
    metric: str = RETURN,
    report: Report = silent,
) -> Payoffs:
    """Play what `store` does not have; each finished pair is kept at once.

    Raises:
        CommandError: there is no such metric, or a pair cannot play.
    """
    pairs = {
        (i, j): Pairing(venue, attacker, defender, len(seeds), seeds.start)
        for i, attacker in enumerate(attackers)
        for j, defender in enumerate(defenders)
    }
    played = play(pairs, store, pool, report=report)
    values = np.zeros((len(attackers), len(defenders), len(seeds)))
    cpu_s = np.zeros(values.shape[:2])
    for place, (result,) in played.results.items():
        values[place] = _metric(result["metrics"], metric)
        cpu_s[place] = result["cpu_s"]
    return Payoffs(values, cpu_s, played.reused)


def has_played(
    venue: Venue, role: Role, mine: Contestant, rivals: Sequence[Contestant], seeds: range, store: Store
) -> bool:
    """Whether a contestant has finished a meeting before, so that it can play."""
    for rival in rivals:
        pair = (mine, rival) if role == "attacker" else (rival, mine)
        with suppress(ConfigurationError):  # one of them cannot play there
            if store.get(make_meeting(venue, *pair, len(seeds), seeds.start)) is not None:
                return True
    return False


def _metric(metrics: dict[str, list[float]], name: str) -> list[float]:
    if name not in metrics:
        raise CommandError(f"there is no metric {name!r}. {near(name, metrics)}")
    return metrics[name]
