"""Families of policies whose numbers a search chooses: controllers of strings."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cps_baselines.disbanding.feedback import COEFFICIENTS, LinearFeedback
from cps_baselines.disbanding.feedback import SHAPE as WEIGHTS
from cps_baselines.disbanding.string_controller import SHAPE, Gains, StringController, shipped_gains
from cps_baselines.family import Family, Number, between
from cps_baselines.searched import built
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policies.policy import Policy, RoleSpec
from cps_envs.core.types import FloatArray

VEHICLES = ("leader", "other")
BROADCAST_ONLY = ("ahead_closing", "ahead_acceleration", "ahead_command")
AGE = "forgetting"  # of no use where what is known is never old
# How far a number is worth moving: the search's unit.
STEP = Gains(
    gap=0.05,
    reach_m=4.0,
    wanted_m=2.0,
    headway_s=0.1,
    closing=0.5,
    closing_lag=1.0,
    predecessor=0.4,
    predecessor_lag=0.8,
    own=0.3,
    ahead_closing=0.3,
    ahead_acceleration=0.3,
    ahead_command=0.4,
    cap=0.4,
    excess_mps=0.5,
    law=0.2,
    forgetting=0.2,
    predecessor_command=0.3,
)
# By hand: close behind everybody, leaders at 12 m, by the predecessor's command, which keeps a string together at any
# lag; what the broadcast tells comes in by the search.
OTHER = Gains(
    gap=0.1,
    reach_m=10.0,
    wanted_m=4.5,
    headway_s=0.0,
    closing=1.5,
    closing_lag=0.0,
    predecessor=0.0,
    predecessor_lag=0.0,
    own=0.0,
    ahead_closing=0.0,
    ahead_acceleration=0.0,
    ahead_command=0.0,
    cap=1.0,
    excess_mps=0.5,
    law=0.0,
    forgetting=0.2,
    predecessor_command=1.0,
)
FOLLOWING = (OTHER._replace(wanted_m=12.0), OTHER)
WARNED = tuple(own._replace(closing=1.0) for own in FOLLOWING)  # those told at once can be softer
ALWAYS = 0.0  # acts at all times: one that joins in late meets those ahead that have followed closely


def _gains(start: Sequence[Gains], *unused: str) -> tuple[Number, ...]:
    """The numbers of both classes of vehicles with their starts, but for the unused ones."""
    return tuple(
        Number(f"{vehicle}.{name}", getattr(own, name), getattr(STEP, name))
        for vehicle, own in zip(VEHICLES, start, strict=True)
        for name in Gains._fields
        if name not in unused
    )


def table(numbers: tuple[Number, ...], values: FloatArray) -> FloatArray:
    """The gains (B, 2, 17) of values (B, k); gains without a number are zero."""
    gains = np.zeros((len(values), *SHAPE))
    places = {f"{v}.{name}": (i, j) for i, v in enumerate(VEHICLES) for j, name in enumerate(Gains._fields)}
    for column, number in enumerate(numbers):
        if number.name in places:
            gains[(slice(None), *places[number.name])] = values[:, column]
    return gains


def _broadcast(spec: RoleSpec, values: FloatArray) -> StringController:
    return StringController(spec, form="informed", gains=table(BROADCAST.numbers, values), detection_mps=math.inf)


def _local(spec: RoleSpec, values: FloatArray) -> StringController:
    gains = table(LOCAL.numbers, values)
    return StringController(spec, form="local", gains=gains, detection_mps=ALWAYS)


# Acts on a warning that is never lost or old, as that of the dissertation.
BROADCAST = Family("disbanding", "defender", "cacc?told=broadcast", _gains(WARNED, AGE), _broadcast)
# Needs no warning, as it acts at all times; each vehicle knows itself, and what its predecessor does and commands.
LOCAL = Family("disbanding", "defender", "cacc", _gains(FOLLOWING, AGE, *BROADCAST_ONLY), _local)

# Acts on a warning that comes late or never, and on its own detection; the search starts at the numbers of `string`.
WARNED_GAINS, WARNED_DETECTION_MPS = shipped_gains("warned")
RADIO_NUMBERS = (
    *_gains([Gains(*row) for row in WARNED_GAINS.tolist()]),
    Number("detection_mps", WARNED_DETECTION_MPS, 0.3, by_factors=True),
)


def _radio(spec: RoleSpec, values: FloatArray) -> StringController:
    gains = table(RADIO_NUMBERS, values)
    policy = StringController(spec, form="warned", gains=gains, detection_mps=values[:, -1])
    policy.searched_numbers = len(RADIO_NUMBERS)  # so were those of `string`
    return policy


RADIO = Family("disbanding", "defender", "cacc?told=radio", RADIO_NUMBERS, _radio)


def _feedback(spec: RoleSpec, values: FloatArray) -> LinearFeedback:
    return LinearFeedback(spec, values.reshape(-1, *WEIGHTS))


# The coefficients of `feedback`, of leaders and of all others; at zero it does nothing.
FEEDBACK = Family(
    "disbanding", "defender", "feedback", tuple(Number(name, 0.0, 1.0) for name in COEFFICIENTS), _feedback
)

# When vehicles act on their own detection, beside or without a warning.
DETECTION = between({"detection_mps": (0.3, 8.0), "hold_s": (0.5, 10.0)}, detection_mps=2.0, hold_s=3.0)
STRING_DETECTION = Family("disbanding", "defender", "string", DETECTION)
FEEDBACK_DETECTION = Family("disbanding", "defender", "feedback", DETECTION)

PLATOONS, JAMS, LATEST_S = (1.0, 5.0), (0.0, 9.0), (21.0, 130.0)
TIMED = Family(
    "disbanding",
    "attacker",
    "timed",
    between(
        {
            "first": PLATOONS,
            "second": PLATOONS,
            "delay_s": (0.0, 30.0),
            "pause_s": (5.0, 130.0),
            "jam": JAMS,
            "jam_at": (1.0, 3.0),
            "jam_s": (-5.0, 10.0),
        },
        first=1.0,
        second=2.0,
        delay_s=0.0,
        pause_s=60.0,
        jam=1.0,
        jam_at=1.0,
        jam_s=-1.0,
    ),
)
ADAPTIVE = Family(
    "disbanding",
    "attacker",
    "adaptive?look_s=20",
    between(
        {
            "slow_mps": (0.0, 15.0),
            "fast_mps": (10.0, 31.0),
            **dict.fromkeys(("slow_s", "middle_s", "fast_s"), LATEST_S),
            "jam": JAMS,
            "jam_s": (-5.0, 10.0),
        },
        slow_mps=6.0,
        fast_mps=18.0,
        slow_s=90.0,
        middle_s=60.0,
        fast_s=40.0,
        jam=1.0,
        jam_s=-1.0,
    ),
)


TOLD = {  # what `cacc` hears beside its predecessor: the name of its numbers, and their family
    "nothing": ("cacc", LOCAL),
    "broadcast": ("cacc_broadcast", BROADCAST),
    "radio": ("cacc_radio", RADIO),
    "robots": ("cacc_robots", BROADCAST),
}


def cacc(spec: RoleSpec, told: str = "nothing", untrained: bool = False, **numbers: float) -> Policy:
    """Cooperative adaptive cruise control: each vehicle follows its predecessor's motion and command.

    `told` says what else it hears: "nothing"; "broadcast", a warning that is never late; "radio", one that comes late
    or never, beside its own detection; or "robots", the broadcast on a road of the test bed's size. `numbers` are
    `Gains` of leaders and others, such as `other.wanted_m`; left out, the searched ones of `searched.json`, or with
    `untrained` those that the search began with.

    Raises:
        ConfigurationError: `told` is something else, or a number is unknown.
    """
    if told not in TOLD:
        raise ConfigurationError(f"told = {told!r} is not known. {near(told, TOLD)}")
    name, family = TOLD[told]
    return built(spec, family, name, numbers, untrained)
