"""Numbers that a search found: `<problem>/searched.json`, with the command and the commit that made them.

A policy says in its attribute `searched_numbers` how many of its numbers a search found, wherever they lie. They are
foreign to other systems than those of the presets, unless numbers of one's own take their place.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from cps_baselines.family import Family
from cps_envs.core.declare.panel import written
from cps_envs.core.policies.lookup import parsed
from cps_envs.core.policies.policy import Policy, RoleSpec


@cache
def found(problem: str) -> Mapping[str, Mapping[str, float]]:
    """The searched numbers of a problem's policies by name, those of each search's best training seed by validation."""
    file = files("cps_baselines").joinpath(problem, "searched.json")
    entries = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return {name: entry["numbers"] for name, entry in entries.items()}


def searched(problem: str, policy: str) -> Mapping[str, float]:
    """The numbers of one of the problem's policies, by name."""
    return found(problem)[policy]


def pinned(problem: str, reference: str) -> str:
    """A policy's reference with its searched numbers written out, so that another search does not change who plays.

    The numbers are those that the reference plays: of `cacc?told=radio` the entry `cacc_radio`. A policy without such
    an entry is returned as it is.
    """
    tree = parsed(reference)
    known = found(problem).get("_".join((tree.title, *map(str, tree.options.values()))))
    return reference if known is None else written(tree.title, **tree.options, **known)


def built(spec: RoleSpec, family: Family, policy: str, numbers: Mapping[str, float], untrained: bool) -> Policy:
    """A policy of a family: by the numbers that are given, the others searched, or as the search began.

    Raises:
        ConfigurationError: the family has no number of such a name, a value is no number, or what the policy refuses.
    """
    known = {} if untrained else searched(family.problem, policy)
    made: Any = family.build(spec, family.row({**known, **numbers}))
    made.searched_numbers = len(known) or getattr(made, "searched_numbers", 0)
    player: Policy = made
    return player
