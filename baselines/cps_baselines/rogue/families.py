"""Families of policies of the rogue-vehicle problem, whose numbers a search chooses, and policies with such numbers."""

from __future__ import annotations

from dataclasses import replace

from cps_baselines.family import Family, Number, between
from cps_baselines.rogue.escort import Escort
from cps_baselines.rogue.guard import Guard
from cps_baselines.rogue.switching import Switching
from cps_envs.core.policies.adapter import advises
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.rogue.giving_way import Ways

WEIGHTS = ("front_gap", "front_rate", "rear_gap", "rear_rate", "excess", "bias")  # as `tuned` names them
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


WEIGHT = Number("", 0.0, 1.0, low=-2.0, high=2.0)
SWITCHING = Family(
    "rogue",
    "attacker",
    "tuned",
    (
        *(replace(WEIGHT, name=name, start=float(name == "front_gap")) for name in WEIGHTS),
        Number("hysteresis", 0.0, 1.0, low=0.0, high=1.0),
    ),
    Switching,
)
BLOWS = {"strike_s": (0.5, 9.0), "period_s": (10.0, 40.0), "effort": (-1.0, 1.0)}
RAMMING = Family("rogue", "attacker", "strike", between(BLOWS, effort=0.9))
BRAKING = Family("rogue", "attacker", "strike", between(BLOWS, effort=-0.9))
MONITOR = Family(
    "rogue",
    "defender",
    "monitor",
    between(
        {
            "margin_mps": (0.3, 3.0),
            "slack_mps2": (0.5, 5.0),
            "threshold_mps": (0.3, 5.0),
            "release_s": (2.0, 40.0),
            "near_m": (0.0, 30.0),
            "near_strong_m": (10.0, 60.0),
            "strong_mps2": (0.2, 1.5),
            "horizon_s": (0.0, 3.0),
        }
    ),
)
ESCORT = Family(
    "rogue",
    "defender",
    "escort",
    tuple(Number(name, start, 0.3, by_factors=True) for name, start in WAYS._asdict().items()),
    Escort,
)


def escort(spec: RoleSpec, **numbers: float) -> Escort:
    """Knows who attacks and from when on: vehicles ahead of it give way, and the nearest one mirrors it.

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
