"""Who plays preset `learning` of a problem, which constants there are, and which numbers a search may change.

Responses are searched among these. A problem declares its own in `<problem>/contest.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec

from cps_baselines.arena import Contestant
from cps_envs.core.types import Role


@dataclass(frozen=True)
class Search:
    """A policy with numbers in it, which are searched by CMA-ES."""

    name: str  # short, such as "tracker"
    policy: str  # a reference; it may have options of its own
    ranges: Mapping[str, tuple[float, float]]  # option -> lowest and highest value; the search starts in the middle
    start: Mapping[str, float] = field(default_factory=dict)  # of options that are better begun elsewhere


@dataclass(frozen=True)
class Side:
    """Who plays one role in a contest."""

    policies: tuple[Contestant, ...]  # that see no more than the role does; `none`, the neutral one, included
    constants: tuple[str, ...]  # policies that take one action: all there are, or a grid, such as "always?action=1"
    informed: tuple[Contestant, ...] = ()  # told what the role has to infer
    searches: tuple[Search, ...] = ()  # together they share the budget of CPU time


@dataclass(frozen=True)
class Contest:
    """Both sides of preset `learning` of a problem."""

    attackers: Side
    defenders: Side

    def side(self, role: Role) -> Side:
        """The side of a role."""
        return self.attackers if role == "attacker" else self.defenders


def declared_contest(problem: str) -> Contest | None:
    """The contest that a problem declares; None where there is none, as for a problem of one's own."""
    module = f"cps_baselines.{problem}.contest"
    if not problem.isidentifier() or find_spec(f"cps_baselines.{problem}") is None or find_spec(module) is None:
        return None
    contest: Contest = import_module(module).CONTEST
    return contest
