"""Numbers that a search found: `<problem>/searched.json`, with the command and the commit that made them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files


@cache
def found(problem: str) -> Mapping[str, Mapping[str, float]]:
    """The searched numbers of a problem's policies by name, those of each search's best training seed by validation."""
    file = files("cps_baselines").joinpath(problem, "searched.json")
    entries = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return {name: entry["numbers"] for name, entry in entries.items()}


def searched(problem: str, policy: str) -> Mapping[str, float]:
    """The numbers of one of the problem's policies, by name."""
    return found(problem)[policy]


def searched_by(problem: str, reference: str) -> Mapping[str, float]:
    """The searched numbers that a reference plays: a variant such as "cacc?told=radio" has its own, `cacc_radio`."""
    name, _, query = reference.partition("?")
    variants = (f"{name}_{pair.partition('=')[2]}" for pair in query.split("&"))
    known = found(problem)
    return next((known[variant] for variant in variants if variant in known), known.get(name, {}))
