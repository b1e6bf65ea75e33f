"""Everybody against everybody: what each pair's episodes paid, from what was played before and what is played now."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cps_agents.benchmark.cell import Cell, make_cell
from cps_agents.benchmark.runner import finish_all
from cps_agents.benchmark.store import Store
from cps_agents.errors import CommandError
from cps_agents.league.players import Player, Venue
from cps_baselines.schedule import Entrant, Setting
from cps_baselines.workers import Workers
from cps_envs.core.errors import near
from cps_envs.core.types import FloatArray

Report = Callable[[int, int, str], None]  # meetings done, meetings in all, the last one
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


def make_meeting(venue: Venue, attacker: Player, defender: Player, seeds: range) -> Cell:
    """The episodes of a pair as a piece of work."""
    setting = Setting(
        name="league",
        title="",
        metric=RETURN,
        attackers=(),
        defenders=(),
        preset=venue.preset,
        overrides=venue.overrides,
    )
    first, second = (Entrant(player.name, player.reference) for player in (attacker, defender))
    return replace(make_cell(venue.problem, setting, first, second, len(seeds)), first_seed=seeds.start)


def play_meetings(
    venue: Venue,
    attackers: Sequence[Player],
    defenders: Sequence[Player],
    seeds: range,
    *,
    store: Store,
    pool: Workers,
    metric: str = RETURN,
    report: Report = lambda done, total, label: None,
) -> Payoffs:
    """Play what `store` does not have; each finished pair is kept at once.

    Raises:
        CommandError: there is no such metric, or a pair cannot play.
    """
    values = np.zeros((len(attackers), len(defenders), len(seeds)))
    cpu_s = np.zeros(values.shape[:2])
    jobs = [make_meeting(venue, attacker, defender, seeds) for attacker in attackers for defender in defenders]
    places = {_key(job): divmod(place, len(defenders)) for place, job in enumerate(jobs)}
    reused = 0
    for done, (job, result, known) in enumerate(finish_all(jobs, store, pool), start=1):
        assert isinstance(job, Cell)
        values[places[_key(job)]] = _metric(result["metrics"], metric)
        cpu_s[places[_key(job)]] = result["cpu_s"]
        reused += known
        report(done, len(jobs), f"{job.attacker} - {job.defender}")
    return Payoffs(values, cpu_s, reused)


def has_played(venue: Venue, player: Player, rivals: Sequence[Player], seeds: range, store: Store) -> bool:
    """Whether a player has finished a meeting before, so that it can play."""
    for rival in rivals:
        pair = (player, rival) if player.role == "attacker" else (rival, player)
        if store.get(make_meeting(venue, *pair, seeds)) is not None:
            return True
    return False


def _key(job: Cell) -> tuple[str, str]:
    return job.attacker, job.defender


def _metric(metrics: dict[str, list[float]], name: str) -> list[float]:
    if name not in metrics:
        raise CommandError(f"there is no metric {name!r}. {near(name, metrics)}")
    return metrics[name]
