"""Who plays preset `learning` of the rogue-vehicle problem: attackers, defenders, constants, numbers of searches."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import product

from cps_baselines.arena import Contestant
from cps_baselines.contest import SearchSpace, Side
from cps_envs.core.types import Role
from cps_envs.rogue.config import LEARNING
from cps_envs.rogue.controllers import CONTROLLERS, DRIVEN

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
WEIGHT = (-2.0, 2.0)
FORM = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias")


def constant(laws: tuple[int, ...], modified: int = 0) -> str:
    """The action of one law for each class of places, as a policy."""
    orders = [0] * (2 * LEARNING.max_vehicles)
    for law, (first, end) in zip(laws, FRONT_CLASSES, strict=True):
        orders[2 * first : 2 * end] = [law, modified] * (end - first)
    return f"always?action={json.dumps(orders, separators=(',', ':'))}"


SWITCHING = SearchSpace("switching", "tuned", dict.fromkeys(FORM, WEIGHT) | {"hysteresis": (0.0, 1.0)})
RAMMING = SearchSpace(
    "strike", "strike", {"strike_s": (0.5, 9.0), "period_s": (10.0, 40.0), "effort": (-1.0, 1.0)}, {"effort": 0.9}
)
BRAKING = SearchSpace("brake", "strike", RAMMING.ranges, {"effort": -0.9})
MONITOR = SearchSpace(
    "monitor",
    "monitor",
    {
        "margin_mps": (0.3, 3.0),
        "slack_mps2": (0.5, 5.0),
        "threshold_mps": (0.3, 5.0),
        "release_s": (2.0, 40.0),
        "near_m": (0.0, 30.0),
        "near_strong_m": (10.0, 60.0),
        "strong_mps2": (0.2, 1.5),
        "horizon_s": (0.0, 3.0),
    },
)

SIDES: Mapping[Role, Side] = {
    "attacker": Side(
        policies=(*ATTACKERS, Contestant("gains"), Contestant("contested_start", "tuned")),
        constants=tuple(f"always?action={share / 10}" for share in range(-10, 11)),
        searches=(SWITCHING, RAMMING, BRAKING),
    ),
    "defender": Side(
        policies=(*DEFENDERS, Contestant("pd_detection")),
        constants=(
            *(constant(laws) for laws in product(range(len(DRIVEN)), repeat=len(FRONT_CLASSES))),
            *(constant((law,) * 3, 1) for law in range(2, len(CONTROLLERS)) if CONTROLLERS[law] != "human"),
        ),
        informed=(Contestant("informed"), Contestant("escort")),
        searches=(MONITOR,),
    ),
}
