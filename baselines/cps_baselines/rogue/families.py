"""Families of policies of the rogue-vehicle problem, whose numbers a search chooses."""

from __future__ import annotations

from cps_baselines.family import Family, Number
from cps_baselines.rogue.boxing_in import BoxingIn, Manners
from cps_baselines.rogue.monitor import Monitor
from cps_baselines.rogue.switching import Switching
from cps_envs.core.policy import RoleSpec
from cps_envs.core.types import FloatArray

WEIGHTS = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias", "hysteresis")  # as `tuned` names them
BEHIND = Manners(  # these and the next came out of a first search: see docs/rogue.md
    wanted_m=5.8,
    headway_s=0.41,
    gap=2.3,
    closing=5.2,
    pushed=0.1,
    stopping=1.7,
    pair_gap=0.26,
    pair_closing=4.8,
    pair_pushed=0.66,
    place=0.0094,
    speed=2.9,
    limit_mps=5.0,
    near_m=2.9,
    slow_mps=0.068,
    touch_mps=0.049,
    approach=0.087,
    grip=4.8,
    press=0.82,
)
AHEAD = Manners(
    wanted_m=8.3,
    headway_s=0.17,
    gap=0.042,
    closing=2.0,
    pushed=0.25,
    stopping=1.4,
    pair_gap=0.39,
    pair_closing=20.0,
    pair_pushed=0.38,
    place=0.35,
    speed=1.9,
    limit_mps=36.0,
    near_m=1.1,
    slow_mps=16.0,
    touch_mps=0.061,
    approach=1.3,
    grip=3.2,
    press=0.57,
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
BOXING_IN = Family(
    "rogue",
    "defender",
    tuple(
        Number(f"{side}_{name}", start, STEP, by_factors=True)
        for side, numbers in (("behind", BEHIND), ("ahead", AHEAD))
        for name, start in numbers._asdict().items()
    ),
    BoxingIn,
)
MONITOR = Family(
    "rogue",
    "defender",
    tuple(Number(name, start, step, by_factors=True) for name, (start, step) in WATCH.items()),
    _monitor,
)
