"""Families of policies of the rogue-vehicle problem, whose numbers a search chooses."""

from __future__ import annotations

from cps_baselines.family import Family, Number
from cps_baselines.rogue.giving_way import GivingWay, Manners
from cps_baselines.rogue.monitor import Monitor
from cps_baselines.rogue.switching import Switching
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import FloatArray

WEIGHTS = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias", "hysteresis")  # as `tuned` names them
BEHIND = Manners(  # these and the next came out of a first search, from numbers set by hand: see docs/rogue.md
    wanted_m=2.8,
    headway_s=0.25,
    gap=1.25,
    closing=7.0,
    pushed=0.24,
    stopping=1.2,
    pair_gap=0.18,
    pair_closing=3.75,
    pair_pushed=1.2,
    place=0.046,
    speed=5.9,
    limit_mps=4.9,
)
AHEAD = Manners(
    wanted_m=5.1,
    headway_s=0.16,
    gap=0.46,
    closing=3.1,
    pushed=1.0,
    stopping=0.54,
    pair_gap=0.34,
    pair_closing=6.6,
    pair_pushed=0.37,
    place=0.3,
    speed=0.71,
    limit_mps=8.4,
)
# The options of `Monitor` and how far the logarithm of each is worth moving. Four start where changing one after the
# other had led on validation seeds; the others as the monitor has them.
WATCH = {
    "near_m": (30.0, 0.3),
    "near_strong_m": (40.0, 0.3),
    "strong_mps2": (0.75, 0.3),
    "horizon_s": (1.0, 0.3),
    "margin_mps": (0.6, 0.4),
    "slack_mps2": (2.0, 0.3),
    "threshold_mps": (3.0, 0.5),
    "release_s": (10.0, 0.4),
}
STEP = 0.5  # of the logarithm of each number


def _monitor(spec: RoleSpec, values: FloatArray) -> Monitor:
    return Monitor(spec, **dict(zip(WATCH, values.T, strict=True)))


SWITCHING = Family(
    "rogue", "attacker", tuple(Number(name, float(name == "front_gap"), 1.0) for name in WEIGHTS), Switching
)
GIVING_WAY = Family(
    "rogue",
    "defender",
    tuple(
        Number(f"{side}_{name}", start, STEP, by_factors=True)
        for side, numbers in (("behind", BEHIND), ("ahead", AHEAD))
        for name, start in numbers._asdict().items()
    ),
    GivingWay,
)
MONITOR = Family(
    "rogue",
    "defender",
    tuple(Number(name, start, step, by_factors=True) for name, (start, step) in WATCH.items()),
    _monitor,
)
