"""The tracks of challenge v1: who is played, how often, and what answers each; see docs/challenge.md.

A problem declares the panels of its two in `cps_envs/<problem>/panels.py`. Whatever changes there makes another
challenge. So searched numbers are written out: a track is known by its content.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import import_module

from cps_agents.arena.venue import Venue
from cps_baselines.searched import pinned
from cps_envs.core.declare.panel import Panel
from cps_envs.core.errors import UnknownNameError, near
from cps_envs.core.types import ROLES, Role, other
from cps_envs.registration import PROBLEMS

CHALLENGE = "challenge-v1"


@dataclass(frozen=True)
class Track:
    """A role of a problem in preset `learning`, against a fixed panel."""

    problem: str
    role: Role
    episodes: int  # against each opponent; the quiet ones that the preset draws are among them
    panel: Panel

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


def tracks() -> Mapping[str, Track]:
    """All eight tracks by name."""
    found = (_track(problem, role) for problem in PROBLEMS for role in ROLES)
    return {track.name: track for track in found}


def _track(problem: str, role: Role) -> Track:
    declared = import_module(f"cps_envs.{problem}.panels")
    panel = (
        replace(each, policy=pinned(problem, each.reference), answer=pinned(problem, each.answer))
        for each in declared.CHALLENGE[other(role)]
    )
    return Track(problem, role, declared.EPISODES[role], tuple(panel))


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
