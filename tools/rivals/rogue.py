"""Who plays preset `learning` of the rogue-vehicle problem: attackers, defenders and constants."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import product

from cps_baselines.arena import Contestant
from cps_envs.core.types import Role
from cps_envs.rogue.config import LEARNING
from cps_envs.rogue.controllers import CONTROLLERS, DRIVEN
from tools.rivals import Rivals

RESPONDED_TO = ("pd", "sliding", "sliding_detection", "disband_7", "assigned", "assigned?laws=f", "monitor")
RESPONSES = tuple(Contestant(f"contested {against}", f"contested?against={against}") for against in RESPONDED_TO)
ATTACKERS = (
    Contestant("none"),
    Contestant("square"),
    Contestant("slow_square", "square?frequency_hz=0.05"),
    Contestant("duty_square"),
    Contestant("random"),
    Contestant("switching"),
    *RESPONSES,
    Contestant("identify"),
    Contestant("strike"),
    Contestant("brake_strike", "strike?effort=-1"),
)
DEFENDERS = (
    *(
        Contestant(name)
        for name in ("none", "pd", "sliding", "sliding_detection", "disband_2", "disband_4", "disband_7")
    ),
    Contestant("assigned"),
    Contestant("ssl", "assigned?laws=ssl"),
    Contestant("front", "assigned?laws=f"),
    Contestant("monitor"),
    Contestant("guard"),
)

FRONT_CLASSES = ((0, 2), (2, 4), (4, LEARNING.max_vehicles))  # places from the rear that have the same law


def constant(laws: tuple[int, ...], modified: int = 0) -> str:
    """The action of one law for each class of places, as a policy."""
    orders = [0] * (2 * LEARNING.max_vehicles)
    for law, (first, end) in zip(laws, FRONT_CLASSES, strict=True):
        orders[2 * first : 2 * end] = [law, modified] * (end - first)
    return f"always?action={json.dumps(orders, separators=(',', ':'))}"


RIVALS: Mapping[Role, Rivals] = {
    "attacker": Rivals(
        policies=(*ATTACKERS, Contestant("gains"), Contestant("contested_start", "tuned")),
        constants=tuple(f"always?action={share / 10}" for share in range(-10, 11)),
    ),
    "defender": Rivals(
        policies=(*DEFENDERS, Contestant("pd_detection")),
        constants=(
            *(constant(laws) for laws in product(range(len(DRIVEN)), repeat=len(FRONT_CLASSES))),
            *(constant((law,) * 3, 1) for law in range(2, len(CONTROLLERS)) if CONTROLLERS[law] != "human"),
        ),
        informed=(Contestant("informed"), Contestant("escort")),
    ),
}
