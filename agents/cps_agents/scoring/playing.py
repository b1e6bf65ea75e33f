"""What the attacker is paid in the episodes of a track."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from cps_agents.arena.play import silent
from cps_agents.scoring.tracks import Track
from cps_agents.workers import Workers
from cps_agents.zoo.references import form_of
from cps_envs.core.declare.seeds import fresh_seeds, score_seeds
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import FloatArray, other
from cps_envs.registration import find_problem

BATCH = 256  # episodes at a time
Seeds = Sequence[Sequence[int]]  # of each opponent of the panel
Report = Callable[[int], None]  # episodes played
Spent = Callable[[int, float], None]  # episodes played, and the CPU seconds that they took


def seeds_of(track: Track, split: str, episodes: int, key: int = 0) -> list[Sequence[int]]:
    """The seeds of a split, of "fresh" by its key; each opponent has its own."""
    places = range(len(track.panel))
    if split == "fresh":
        return [fresh_seeds(key, place, episodes) for place in places]
    return [score_seeds(split, place, episodes) for place in places]


def parted(seeds: Seeds, parts: int) -> list[list[Sequence[int]]]:
    """The seeds of each of so many parts, equally many against each opponent: what each training seed plays."""
    counts = [len(own) // parts for own in seeds]
    return [
        [own[place * count : (place + 1) * count] for own, count in zip(seeds, counts, strict=True)]
        for place in range(parts)
    ]


def pays(
    track: Track, policy: PolicyReference, seeds: Seeds, report: Spent = silent, pool: Workers | None = None
) -> list[FloatArray]:
    """What the attacker is paid against each opponent, one value for each of its seeds.

    Raises:
        UnknownNameError, TypeError, ConfigurationError: the policy cannot play the role in this configuration.
    """
    return played(track, [policy] * len(track.panel), seeds, report, pool)


def answers(track: Track, seeds: Seeds) -> list[FloatArray]:
    """The same of the best answers that were known at the freeze, each against its own opponent."""
    return played(track, [rival.answer for rival in track.panel], seeds)


def played(
    track: Track,
    policies: Sequence[PolicyReference],
    seeds: Seeds,
    report: Spent = silent,
    pool: Workers | None = None,
) -> list[FloatArray]:
    """What the attacker is paid where each of `policies` meets the opponent at its place of the panel.

    Without a `pool` they play in this process.
    """
    batches = [
        Batch(place, first, policy, rival.reference, own[first : first + BATCH])
        for place, (policy, rival, own) in enumerate(zip(policies, track.panel, seeds, strict=True))
        for first in range(0, len(own), BATCH)
    ]
    done, cpu_s, found = 0, 0.0, [np.empty(len(own)) for own in seeds]
    for part, (paid, own_s) in (pool or Workers(1)).run(partial(_play, track), batches):
        found[part.place][part.first : part.first + len(part.seeds)] = paid
        done, cpu_s = done + len(part.seeds), cpu_s + own_s
        report(done, cpu_s)
    return found


class Batch(NamedTuple):
    """Episodes that are played at once."""

    place: int  # of the opponent in the panel
    first: int  # place of the first seed among all against this opponent
    policy: PolicyReference
    opponent: str
    seeds: Sequence[int]


def _play(track: Track, part: Batch) -> tuple[FloatArray, float]:
    started = time.process_time()
    return batch(track, part.policy, part.opponent, part.seeds), time.process_time() - started


def batch(track: Track, policy: PolicyReference, opponent: str, seeds: Sequence[int]) -> FloatArray:
    """What the attacker is paid in the episodes of these seeds, all at once."""
    problem, config = find_problem(track.problem), track.venue.config
    if isinstance(policy, str):
        config = problem.config(track.venue.preset, form_of(policy, config))
    players: Any = {track.role: policy, other(track.role): opponent}
    paid: FloatArray = play_episodes(problem, config, players, seeds)["return"]
    return paid
