"""A policy's score in a track: 0 for the best that does not look, 100 for the best answers known at the freeze."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from cps_agents.arena.play import silent
from cps_agents.arena.statistics import Estimate, estimate
from cps_agents.errors import CommandError
from cps_agents.machine import versions
from cps_agents.scoring.frozen import DEV, Frozen, read_frozen, rounded, texts
from cps_agents.scoring.kind import CODE, Kind, kind_of
from cps_agents.scoring.playing import Report, answers, parted, pays, seeds_of
from cps_agents.scoring.tracks import CHALLENGE, find_track
from cps_agents.workers import Where, Workers
from cps_agents.zoo.lookup import playable
from cps_agents.zoo.references import origin_of
from cps_envs.core.policies.lookup import PolicyReference
from cps_envs.core.types import FloatArray
from cps_envs.registration import find_problem

Split = Literal["test", "dev"]
FRESH = "fresh"  # a split whose episodes nobody knows before they are played
SEEDS = 5  # training seeds of a network, below which the line says how many there are
RESAMPLES = 1000


@dataclass(frozen=True)
class Score:
    """What a policy reached: pays of the attacker and all that follows from them."""

    frozen: Frozen
    split: str
    policy: str  # reference; of an object that Python handed over its class
    kind: Kind
    pays: Mapping[
        str, Sequence[FloatArray]
    ]  # training seed -> for each opponent, its part of the episodes; "": no seed
    sources: Mapping[str, str] = field(default_factory=dict)  # hashes of trained networks and of code of one's own
    cpu_s: float = 0.0
    versions: Mapping[str, str] = field(default_factory=versions)
    began: Score | None = None  # of a network of the leaderboard: its wiring before any training, in the same episodes
    key: str = ""  # of fresh episodes, hexadecimal

    @property
    def playable(self) -> bool:
        """Whether the reference alone plays it in this process."""
        return self.kind.name != CODE

    @cached_property
    def against(self) -> list[FloatArray]:
        """For each opponent the scores of single episodes (training seeds, their episodes)."""
        parts = (np.array(paid) for paid in zip(*self.pays.values(), strict=True))
        return [self.frozen.values(self.split, place, paid) for place, paid in enumerate(parts)]

    @cached_property
    def strata(self) -> list[FloatArray]:
        """For each opponent an array (training seeds, their episodes); the mean of their means is the score."""
        track = self.frozen.track
        shares = zip(self.against, track.shares, strict=True)
        return [100.0 + len(track.panel) * share * (found - 100.0) for found, share in shares]

    @cached_property
    def estimate(self) -> Estimate:
        """The score with its 95 % interval: over training seeds if several, never less than over episodes."""
        return _estimate(self.strata)

    @property
    def half_width(self) -> float:
        """Half of the interval."""
        return _width(self.estimate) / 2

    @property
    def opponents(self) -> dict[str, float]:
        """The score against each opponent."""
        panel = zip(self.frozen.track.panel, self.against, strict=True)
        return {rival.name: float(found.mean()) for rival, found in panel}

    @property
    def by_seed(self) -> dict[str, float]:
        """The score of each training seed, in its own part of the episodes."""
        means = np.mean([values.mean(axis=1) for values in self.strata], axis=0)
        return dict(zip(self.pays, means.tolist(), strict=True))

    @cached_property
    def added(self) -> Estimate | None:
        """What training added to what the network began with, in pairs; None where that was not played."""
        return None if self.began is None else self.minus(self.began)

    @property
    def line(self) -> str:
        """The line to cite."""
        track, found = self.frozen.track, self.opponents
        worst = min(found, key=lambda name: found[name])
        few = f", {len(self.pays)} training seed{'s' * (len(self.pays) > 1)}"
        return (
            f"{CHALLENGE} {track.name} {self.split}/{self.episodes}: {self.estimate.mean:.1f} ± {self.half_width:.1f}, "
            f"worst {found[worst]:.0f} ({worst}){few if self.kind.network and len(self.pays) < SEEDS else ''} "
            f"(digest {self.frozen.digest}, {track.problem}-v{find_problem(track.problem).version})"
        )

    @property
    def episodes(self) -> int:
        """Against each opponent."""
        return len(self.frozen.pays[self.split][0])

    def minus(self, other: Score) -> Estimate:
        """How much higher this score is, in pairs on the same episodes.

        Two that have several training seeds, but not as many, divide the episodes otherwise and are not paired.

        Raises:
            CommandError: the other one is of another track or split.
        """
        mine, theirs = ((each.frozen.track.name, each.split) for each in (self, other))
        if mine != theirs:
            raise CommandError(f"scores of {' '.join(mine)} and {' '.join(theirs)} cannot be compared")
        parts = max(len(self.pays), len(other.pays))
        if {len(self.pays), len(other.pays)} <= {1, parts}:
            sides = (_in_parts(each.strata, parts) for each in (self, other))
            return _estimate([one - two for one, two in zip(*sides, strict=True)])
        found, around = self.estimate.mean - other.estimate.mean, float(np.hypot(self.half_width, other.half_width))
        return Estimate(found, found - around, found + around, len(self.pays), self.episodes)

    def to_json(self) -> dict[str, Any]:
        """All numbers, for people and programs; files of the leaderboard are written by `results.write_result`."""
        added = self.added
        return {
            "challenge": CHALLENGE,
            "track": self.frozen.track.name,
            "split": self.split,
            "digest": self.frozen.digest,
            "line": self.line,
            "policy": self.policy,
            "kind": {"name": self.kind.name, "by": self.kind.by, "numbers": self.kind.numbers},
            "sources": dict(self.sources),
            "score": round(self.estimate.mean, 2),
            "half_width": round(self.half_width, 2),
            "opponents": {name: round(value, 2) for name, value in self.opponents.items()},
            "by_seed": {seed: round(value, 2) for seed, value in self.by_seed.items()},
            "began": None if self.began is None else round(self.began.estimate.mean, 2),
            "added": None if added is None else [round(each or 0.0, 2) for each in (added.mean, added.low, added.high)],
            "cpu_s": round(self.cpu_s, 1),
            "versions": dict(self.versions),
            "pays": {seed: texts(rows) for seed, rows in self.pays.items()},
        }


def _in_parts(strata: Sequence[FloatArray], parts: int) -> list[FloatArray]:
    """Arrays (1, E) or (parts, E / parts) as arrays (parts, E / parts) of the same episodes."""
    counts = [values.size // parts for values in strata]
    return [values.ravel()[: parts * count].reshape(parts, count) for values, count in zip(strata, counts, strict=True)]


def _estimate(strata: Sequence[FloatArray]) -> Estimate:
    """The mean with the wider of two intervals: over training seeds, each in its own episodes, and over episodes."""
    over_episodes = estimate([values.reshape(1, -1) for values in strata], resamples=RESAMPLES)
    if len(strata[0]) == 1:
        return over_episodes
    means = np.mean([values.mean(axis=1) for values in strata], axis=0)[:, np.newaxis]
    over_seeds = estimate([means], resamples=RESAMPLES)
    wider = max((over_seeds, over_episodes), key=_width)
    return Estimate(over_seeds.mean, wider.low, wider.high, over_seeds.seeds, over_seeds.episodes)


def _width(found: Estimate) -> float:
    assert found.low is not None
    assert found.high is not None
    return found.high - found.low


def score(
    track: str,
    policy: PolicyReference,
    *,
    split: Split = "test",
    sampled: bool = False,
    report: Report = silent,
    workers: Where = 1,
) -> Score:
    """Score a policy: a reference, or any object with `predict`, such as a model of stable-baselines3.

    All training seeds of `zoo:NAME` and of `sb3:FOLDER` play, each its own part of the episodes. `sampled` is for a
    model as an object that is to draw its actions. `report` is told how many episodes have been played. Several
    processes, or a cluster, can play a reference; an object plays in this process. This is a look of your own: on the
    leaderboard stands what its verifier has played.

    Raises:
        UnknownNameError: there is no such track or policy.
        ConfigurationError, TypeError: the policy does not fit the role.
        CommandError: the track is not frozen, this installation plays another game, or an object is to play elsewhere.
    """
    found = find_track(track)
    frozen = read_frozen(found)
    if not isinstance(policy, str) and workers != 1:
        raise CommandError("a policy that is an object plays in this process: leave `workers` out, or name a reference")
    frozen.check_game()
    return scored(frozen, policy, split, sampled=sampled, report=report, workers=workers)


def scored(
    frozen: Frozen,
    policy: PolicyReference,
    split: str,
    *,
    kind: Kind | None = None,
    key: str = "",
    sampled: bool = False,
    report: Report = silent,
    workers: Where = 1,
) -> Score:
    """See `score`; `kind` None: as `kind_of` finds it. In split fresh the best answers play as well, by the `key`."""
    found = frozen.track
    seeds = seeds_of(found, split, found.episodes // (DEV if split == "dev" else 1), int(key or "0", 16))
    if split == FRESH:
        frozen = replace(frozen, pays={FRESH: [rounded(own) for own in answers(found, seeds)]})
    origin = None
    if isinstance(policy, str):
        origin = origin_of(found.problem, policy)
        players: Mapping[int | None, PolicyReference] = dict(origin.seeds)
    else:
        spec = find_problem(found.problem).game(found.venue.config, 1).spec(found.role)
        players = {None: playable(policy, spec, sampled=sampled)}
    first = next(iter(players.values()))
    kind = kind or kind_of(found, first)
    paid: dict[str, Sequence[FloatArray]] = {}
    before, spent_s, now_s = 0, 0.0, 0.0

    def told(done: int, cpu_s: float) -> None:
        nonlocal now_s
        now_s = spent_s + cpu_s
        report(before + done)

    with Workers(workers) as pool:
        for (seed, player), own in zip(players.items(), parted(seeds, len(players)), strict=True):
            rows = pays(found, player, own, told, pool)
            paid["" if seed is None else str(seed)] = [rounded(row) for row in rows]
            before, spent_s = before + sum(map(len, own)), now_s
    return Score(
        frozen=frozen,
        split=split,
        policy=policy if isinstance(policy, str) else f"{type(policy).__module__}:{type(policy).__qualname__}",
        kind=kind,
        pays=paid,
        sources={} if origin is None else origin.sources,
        cpu_s=spent_s,
        key=key,
    )
