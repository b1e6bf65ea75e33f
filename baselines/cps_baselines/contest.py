"""Who plays preset `learning` of a problem, which constants there are, and which numbers a search may change.

Responses are searched among these. `SIDES` declares them for both roles, in `<problem>/contest.py`, or in the module of
a problem of one's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec

from cps_baselines.arena import Contestant
from cps_envs.core.types import Role


@dataclass(frozen=True)
class SearchSpace:
    """A policy with numbers in it, which are searched by CMA-ES."""

    name: str  # short, such as "tracker"
    policy: str  # a reference; it may have options of its own
    ranges: Mapping[str, tuple[float, float]]  # option -> lowest and highest value; the search starts in the middle
    start: Mapping[str, float] = field(default_factory=dict)  # of options that are better begun elsewhere


@dataclass(frozen=True)
class Side:
    """The policies that stand for one role in preset `learning`: what they are told, and which numbers are searched."""

    policies: tuple[Contestant, ...] = ()  # that see no more than the role does; `none`, the neutral one, included
    constants: tuple[str, ...] = ()  # policies that take one action, all or a grid of them, such as "always?action=1"
    informed: tuple[Contestant, ...] = ()  # told what the role has to infer
    searches: tuple[SearchSpace, ...] = ()  # together they share the budget of CPU time


def side_of(problem: str, role: Role) -> Side:
    """What a problem declares for a role; an empty side where it declares nothing.

    `problem` is a name, or "module:attribute", whose module is imported.
    """
    module, colon, _ = problem.partition(":")
    if not colon:
        package = f"cps_baselines.{problem}"
        module = f"{package}.contest" if find_spec(package) is not None else ""
    if not module or find_spec(module) is None:
        return Side()
    sides: Mapping[Role, Side] = getattr(import_module(module), "SIDES", {})
    return sides.get(role, Side())
