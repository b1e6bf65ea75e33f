"""Policies of false data injection that take one action."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from itertools import product

from cps_envs.core.types import Role

VEHICLES, LEVELS, CORRECTIONS = 4, 20, 4  # of preset `learning`: vehicles, levels to either side, of both kinds
PAIRED = VEHICLES - 1  # gaps with a rear sensor


def constant_attacks() -> Iterator[str]:
    """The same level on all attacked sensors, then one level of ranges and another of range-rates."""
    yield from (f"always?action={level}" for level in range(2 * LEVELS + 1))
    for ranges, rates in product((0, 10, 15, 20, 25, 30, 40), repeat=2):
        if ranges != rates:
            yield always([ranges] * (VEHICLES + PAIRED) + [rates] * (VEHICLES + PAIRED))


def constant_defences() -> Iterator[str]:
    """Each set of radars never believed; no ranges; no range-rates; each correction of one or all vehicles."""
    units = VEHICLES + PAIRED
    none = [CORRECTIONS] * VEHICLES
    for trust in product((1, 0), repeat=units):
        yield always([*trust, *trust, *none])
    yield always([0] * units + [1] * units + none)
    yield always([1] * units + [0] * units + none)
    for level in range(2 * CORRECTIONS + 1):
        if level != CORRECTIONS:
            yield always([1] * 2 * units + [level] * VEHICLES)
            for vehicle in range(VEHICLES):
                yield always([1] * 2 * units + [*none[:vehicle], level, *none[vehicle + 1 :]])


def always(action: list[int]) -> str:
    """The reference of a constant action."""
    return f"always?action={json.dumps(action, separators=(',', ':'))}"


CONSTANTS: Mapping[Role, tuple[str, ...]] = {
    "attacker": tuple(constant_attacks()),
    "defender": tuple(constant_defences()),
}
