"""Recipes as files keep them, also those written before a knob was added."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from cps_agents.console import to_json
from cps_agents.learning.recipe import Recipe


def knobs_of(recipe: Recipe) -> dict[str, Any]:
    """Every knob as a JSON file has it."""
    found: dict[str, Any] = json.loads(to_json(asdict(recipe)))
    return found


def differing(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Knobs in which two kept recipes differ; one that a file does not have yet stands at its default."""
    usual = knobs_of(Recipe())
    ours, theirs = {**usual, **first}, {**usual, **second}
    return sorted(name for name in ours.keys() | theirs.keys() if ours.get(name) != theirs.get(name))
