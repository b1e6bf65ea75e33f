"""Which numbers of a policy a search for responses may change, and how far.

`SEARCHES` declares them for both roles, in `<problem>/searches.py`, or in the module of a problem of one's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec

from cps_envs.core.types import Role


@dataclass(frozen=True)
class SearchSpace:
    """A policy with numbers in it, which are searched by CMA-ES."""

    name: str  # short, such as "tracker"
    policy: str  # a reference; it may have options of its own
    ranges: Mapping[str, tuple[float, float]]  # option -> lowest and highest value; the search starts in the middle
    start: Mapping[str, float] = field(default_factory=dict)  # of options that are better begun elsewhere


Searches = Mapping[Role, tuple[SearchSpace, ...]]  # those of a role share a budget of CPU time


def searches_of(problem: str, role: Role) -> tuple[SearchSpace, ...]:
    """What a problem declares for a role; nothing where it declares nothing.

    `problem` is a name, or "module:attribute", whose module is imported.
    """
    module, colon, _ = problem.partition(":")
    if not colon:
        package = f"cps_baselines.{problem}"
        module = f"{package}.searches" if find_spec(package) is not None else ""
    if not module or find_spec(module) is None:
        return ()
    declared: Searches = getattr(import_module(module), "SEARCHES", {})
    return declared.get(role, ())
