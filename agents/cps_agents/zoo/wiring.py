"""The entry `wiring` of a card: how its network is wired to the role. Reading a card does not load any game."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

MOST_FRAME_SKIP = 10**6
MOST_S = 1e9  # of a time constant
MOST_AVERAGES = 100


def check_wiring(entry: Mapping[str, Any]) -> None:
    """Check that the entry has what a wiring needs, and nothing else; what later versions have added may be missing.

    Raises:
        ValueError: it has not.
    """
    odd = sorted((set(entry) - set(CHECKS)) | (set(CHECKS) - set(entry) - LATER))
    if odd:
        raise ValueError(f"the entries of its wiring are not those of this version: {', '.join(odd)}")
    for name, fits in CHECKS.items():
        if name in entry and not fits(entry[name]):
            raise ValueError(f"its wiring has {name} = {str(entry[name])[:40]!r}, which makes no sense")


def _number(low: float, high: float) -> Callable[[Any], bool]:
    def fits(value: Any) -> bool:
        return type(value) in (int, float) and math.isfinite(value) and low <= value <= high

    return fits


def _numbers(most: int, low: float, high: float) -> Callable[[Any], bool]:
    one = _number(low, high)

    def fits(value: Any) -> bool:
        return isinstance(value, (list, tuple)) and len(value) <= most and all(one(each) for each in value)

    return fits


LATER = frozenset({"joint", "flat", "plain", "legal"})
CHECKS: Mapping[str, Callable[[Any], bool]] = {
    "adapter": lambda value: isinstance(value, str),
    "frame_skip": lambda value: type(value) is int and 1 <= value <= MOST_FRAME_SKIP,
    "recent_s": _numbers(MOST_AVERAGES, 1e-9, MOST_S),
    "rough_s": _number(0.0, MOST_S),
    "masked": lambda value: isinstance(value, bool),  # whether the last inputs say what is legal
    "joint": lambda value: isinstance(value, bool),  # whether one row holds all agents of a team
    "flat": lambda value: isinstance(value, bool),  # whether one number stands for all entries of an action
    "plain": lambda value: isinstance(value, bool),  # whether a row holds nothing but what the adapter shows
    "legal": lambda value: isinstance(value, bool),  # whether the policy takes legal actions only, where it sees which
    "sampled": lambda value: isinstance(value, bool),  # whether the policy draws, where nothing else is asked for
}
