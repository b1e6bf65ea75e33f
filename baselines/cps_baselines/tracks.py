"""The tracks of challenge v1, as plain data: who is played, how often, and what answers each; see docs/challenge.md.

A problem declares its two in `<problem>/tracks.py`. Whatever changes here makes another challenge.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from cps_baselines.arena import Venue
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.types import Role

CHALLENGE = "challenge-v1"
PROBLEMS = ("rogue", "fdi", "hvac", "disbanding")


@dataclass(frozen=True)
class Rival:
    """An opponent of a panel, and the best answer to it that was known when the challenge was frozen."""

    name: str  # short, for tables
    policy: str  # reference with every number
    answer: str  # reference of the own role, may be told what the role has to infer; it has the score 100
    weight: float = 1.0


@dataclass(frozen=True)
class Track:
    """A role of a problem in preset `learning`, against a fixed panel."""

    problem: str
    role: Role
    episodes: int  # against each opponent; the quiet ones that the preset draws are among them
    panel: tuple[Rival, ...]

    @property
    def name(self) -> str:
        """Such as rogue-attack."""
        return f"{self.problem}-{'attack' if self.role == 'attacker' else 'defense'}"

    @property
    def venue(self) -> Venue:
        """The configuration."""
        return Venue(self.problem)

    @property
    def sign(self) -> float:
        """1 where more pay of the attacker is better, -1 where less is."""
        return 1.0 if self.role == "attacker" else -1.0

    @property
    def shares(self) -> tuple[float, ...]:
        """The weights of the opponents, as shares of one."""
        total = sum(rival.weight for rival in self.panel)
        return tuple(rival.weight / total for rival in self.panel)


def written(name: str, **options: Any) -> str:
    """A policy's reference with its options, such as "chi2?gate=0.01"."""
    pairs = (f"{key}={value if isinstance(value, str) else json.dumps(value)}" for key, value in options.items())
    return f"{name}?{'&'.join(pairs)}" if options else name


def tracks() -> Mapping[str, Track]:
    """All eight tracks by name."""
    found = (each for problem in PROBLEMS for each in import_module(f"cps_baselines.{problem}.tracks").TRACKS)
    return {track.name: track for track in found}


def find_track(name: str) -> Track:
    """The track of a name.

    Raises:
        UnknownNameError: there is none.
    """
    known = tracks()
    if name not in known:
        own = "A problem of your own has none: judge it with evaluate or league"
        raise UnknownNameError(f"there is no track {name!r}. {near(name, known)} {own}")
    return known[name]
