"""Families of policies of the rogue-vehicle problem, whose numbers a search chooses, and policies with such numbers."""

from __future__ import annotations

from cps_baselines.family import Family, Number
from cps_baselines.rogue.boxing_in import BoxingIn, Manners
from cps_baselines.rogue.escort import Escort, Ways
from cps_baselines.rogue.guard import Guard
from cps_baselines.rogue.switching import Switching
from cps_baselines.searched import built
from cps_envs.core.policies.adapter import advises
from cps_envs.core.policies.policy import Policy, RoleSpec

WEIGHTS = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias", "hysteresis")  # as `tuned` names them
BEHIND = Manners(  # these and the next came out of a first search: see docs/details/rogue.md
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
WAYS = Ways(  # by policy search against the panel of rogue-defense, from numbers set by hand
    gap_gain=0.485,
    rate_gain=0.477,
    speed=5.42,
    place=0.0309,
    limit_mps=45.8,
    pair_gap=0.974,
    pair_closing=5.25,
    allowed_mps=0.348,
    stopping=40.2,
    wanted_m=2.13,
    pushed=0.059,
    near_m=8.05,
    slow_mps=8.05,
    touch_mps=2.83,
    approach=1.26,
    most_mps=0.0747,
    grip=16.9,
    mirror=1.7,
    home=0.42,
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
ESCORT = Family(
    "rogue",
    "defender",
    tuple(Number(name, start, 0.3, by_factors=True) for name, start in WAYS._asdict().items()),
    Escort,
)


def escort(spec: RoleSpec, **numbers: float) -> Escort:
    """Is told who attacks and from when on: vehicles ahead of it give way, and the nearest one mirrors it.

    `numbers` are those of `Ways`, such as `near_m`; left out, those that a search found.

    Raises:
        ConfigurationError: an unknown number, or what `Escort` refuses.
    """
    return Escort(spec, ESCORT.row(numbers))


@advises("cps_baselines.rogue.advised:Guarded")
def guard(spec: RoleSpec, threshold_mps: float = 2.0, slack_mps2: float = 2.0, **numbers: float) -> Guard:
    """Watches as `monitor` does. From the first suspicion on it gives way to the suspect as `escort` does.

    `threshold_mps` and `slack_mps2` are those of `monitor`, `numbers` those of `escort`.

    Raises:
        ConfigurationError: an unknown number, or what `Guard` refuses.
    """
    return Guard(spec, ESCORT.row(numbers), threshold_mps, slack_mps2)


def box_in(spec: RoleSpec, untrained: bool = False, **numbers: float) -> Policy:
    """Holds a known attacker between its two neighbors, which come up to it softly; the others give way.

    `numbers` are those of `Manners`, behind and ahead of the attacker, such as `ahead_slow_mps`; left out, the searched
    ones of `searched.json`: of policy search, and then of rounds in which attacks and numbers were searched in turn.
    With `untrained` it plays the hand-set numbers that the first search began with.

    Raises:
        ConfigurationError: an unknown number, or what `BoxingIn` refuses.
    """
    return built(spec, BOXING_IN, "box_in", numbers, untrained)
