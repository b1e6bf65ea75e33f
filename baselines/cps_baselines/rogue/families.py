"""Families of policies of the rogue-vehicle problem, whose numbers a search chooses, and `box_in` with such numbers."""

from __future__ import annotations

from cps_baselines.family import Family, Number
from cps_baselines.rogue.boxing_in import BoxingIn, Manners
from cps_baselines.rogue.switching import Switching
from cps_baselines.searched import searched
from cps_envs.core.policy import RoleSpec

WEIGHTS = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias", "hysteresis")  # as `tuned` names them
BEHIND = Manners(  # these and the next came out of a first search: see docs/rogue.md
    wanted_m=5.16,
    headway_s=0.332,
    gap=2.11,
    closing=6.6,
    pushed=0.0886,
    stopping=1.37,
    pair_gap=0.484,
    pair_closing=5.16,
    pair_pushed=0.473,
    place=0.00573,
    speed=1.7,
    limit_mps=4.16,
    near_m=1.55,
    slow_mps=0.0588,
    touch_mps=-0.313,
    approach=-1.19,
    mirror=0.0145,
    grip=10.3,
    press=7.65,
)
AHEAD = Manners(
    wanted_m=5.27,
    headway_s=0.37,
    gap=0.0523,
    closing=3.6,
    pushed=0.716,
    stopping=2.16,
    pair_gap=0.545,
    pair_closing=15.2,
    pair_pushed=0.607,
    place=0.179,
    speed=0.612,
    limit_mps=31.9,
    near_m=5.1,
    slow_mps=14.7,
    touch_mps=-0.288,
    approach=-0.385,
    mirror=0.022,
    grip=22.5,
    press=4.95,
)
STEP = 0.5  # of the logarithm of each number
STEPS = {"touch_mps": 0.1, "approach": 0.5}  # of the numbers themselves, which may be negative


SWITCHING = Family(
    "rogue", "attacker", tuple(Number(name, float(name == "front_gap"), 1.0) for name in WEIGHTS), Switching
)
BOXING_IN = Family(
    "rogue",
    "defender",
    tuple(
        Number(f"{side}_{name}", start, STEPS.get(name, STEP), by_factors=name not in STEPS)
        for side, numbers in (("behind", BEHIND), ("ahead", AHEAD))
        for name, start in numbers._asdict().items()
    ),
    BoxingIn,
)


def box_in(spec: RoleSpec, **numbers: float) -> BoxingIn:
    """Holds a known attacker between its two neighbors, which come up to it softly; the others give way.

    `numbers` are those of `Manners`, behind and ahead of the attacker, such as `ahead_slow_mps`; left out, the searched
    ones of `searched.json`. There `ahead_slow_mps` is set by hand: the search had put it above the platoon's speed, so
    that the vehicles ahead let the attacker alone whenever it fell back.

    Raises:
        ConfigurationError: an unknown number, or what `BoxingIn` refuses.
    """
    return BoxingIn(spec, BOXING_IN.row({**searched("rogue", "box_in"), **numbers}))
