"""Policies of the disbanding problem that take one action."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

from cps_envs.core.types import Role
from cps_envs.disbanding.config import LEARNING

ATTACKS = LEARNING.num_attacks
LEVELS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # shares of 6 m/s2, of either sign


def constant_corrections() -> Iterator[str]:
    """The same correction of all vehicles, of the leaders, of the others, and of the rear half."""
    size, vehicles = LEARNING.vehicles_per_platoon, LEARNING.max_vehicles
    leaders = [float(q % size == 0) for q in range(vehicles)]
    rear = [float(q >= vehicles // 2) for q in range(vehicles)]
    for level in sorted((*LEVELS, *(-level for level in LEVELS))):
        yield f"always?action={level}"
        for shares in (leaders, [1.0 - share for share in leaders], rear):
            yield f"always?action={json.dumps([level * share for share in shares], separators=(',', ':'))}"


CONSTANTS: Mapping[Role, tuple[str, ...]] = {
    "attacker": tuple(f"always?action={action}" for action in range(ATTACKS)),
    "defender": tuple(constant_corrections()),
}
