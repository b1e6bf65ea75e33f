"""Policies of the rogue-vehicle problem that take one action."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import product

from cps_envs.core.types import Role
from cps_envs.rogue.config import LEARNING
from cps_envs.rogue.controllers import CONTROLLERS, DRIVEN

FRONT_CLASSES = ((0, 2), (2, 4), (4, LEARNING.max_vehicles))  # places from the rear that have the same law


def constant(laws: tuple[int, ...], modified: int = 0) -> str:
    """The action of one law for each class of places, as a policy."""
    orders = [0] * (2 * LEARNING.max_vehicles)
    for law, (first, end) in zip(laws, FRONT_CLASSES, strict=True):
        orders[2 * first : 2 * end] = [law, modified] * (end - first)
    return f"always?action={json.dumps(orders, separators=(',', ':'))}"


CONSTANTS: Mapping[Role, tuple[str, ...]] = {
    "attacker": tuple(f"always?action={share / 10}" for share in range(-10, 11)),
    "defender": (
        *(constant(laws) for laws in product(range(len(DRIVEN)), repeat=len(FRONT_CLASSES))),
        *(constant((law,) * 3, 1) for law in range(2, len(CONTROLLERS)) if CONTROLLERS[law] != "human"),
    ),
}
