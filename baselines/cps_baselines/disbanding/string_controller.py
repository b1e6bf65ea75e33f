"""Extension beyond the paper: a controller of few numbers for every vehicle, found by `string_search`.

It sets the gap itself instead of correcting towards x_d: what is to be found is how closely vehicles may follow one
another behind human drivers, and how much of what the warning says to use.
"""

from __future__ import annotations

import json
import math
from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple, TypeAlias

import numpy as np

from cps_baselines.disbanding.corrections import HOLD_S, Corrections, Layout, Sight, look, sight_for
from cps_baselines.family import as_records
from cps_envs.core.compute.kernels import borrowed, clip, inlined, kernel, lend, unpack
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.policies.adapter import advises
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Observation


class Gains(NamedTuple):
    """The numbers of one class of vehicles, platoon leaders or others; u is the commanded acceleration in m/s2."""

    gap: float  # 1/s2, u per metre of gap beyond the wanted one
    reach_m: float  # m, to which that difference is limited
    wanted_m: float  # m, the wanted gap at rest
    headway_s: float  # s, what it grows by with the own speed
    closing: float  # 1/s, u per m/s that the predecessor is faster
    closing_lag: float  # 1/s2, what that grows by with tau
    predecessor: float  # u per acceleration of the predecessor
    predecessor_lag: float  # 1/s, what that grows by with tau
    own: float  # u per own acceleration
    ahead_closing: float  # 1/s, u per m/s that the disbanded vehicle is faster
    ahead_acceleration: float  # u per acceleration of the disbanded vehicle
    ahead_command: float  # u per command of the disbanded vehicle
    cap: float  # 1/s, u is at most this times the speed that is missing to the desired one
    excess_mps: float  # m/s, plus this
    law: float  # u less this share of the plain law's command, limited to [u_min, u_max]
    forgetting: float  # 1/s, what is known of the disbanded vehicle counts 1 / (1 + this * its age)
    predecessor_command: float = 0.0  # u per command of the predecessor now, by radio


Road: TypeAlias = tuple[int, float, float, float]  # n, tau in s, desired speed in m/s, largest correction in m/s2
SIZE = len(Gains._fields)
SHAPE = (2, SIZE)  # leaders, others
FORMS = ("warned", "local", "informed")


@lru_cache(maxsize=len(FORMS))
def shipped_gains(form: str) -> tuple[FloatArray, float]:
    """The numbers (2, 17) that come with the package, leaders first, and the threshold (m/s) found with them."""
    text = files("cps_baselines.disbanding").joinpath("string.json").read_text(encoding="utf-8")
    found = json.loads(text)[form]
    return np.array([Gains(*row) for row in found["gains"]], dtype=np.float64), float(found["detection_mps"])


@advises("cps_baselines.disbanding.advised:Strung")
class StringController(Corrections):
    """Lets each vehicle choose its own gap, by tuned gains: one set for leaders, one for all others.

    Form "warned" acts on the warning and on its own detection and uses the record; "local" uses no warning at all;
    "informed" has the numbers for a warning that is perfect.
    `gains` is (2, 17), or (B, 2, 17) with one set per episode; left out, the shipped ones of the form.

    Raises:
        ConfigurationError: an unknown form.
        ValueError: `gains` has another shape.
    """

    def __init__(
        self,
        spec: RoleSpec,
        *,
        form: str = "warned",
        gains: FloatArray | None = None,
        detection_mps: float | FloatArray | None = None,
        hold_s: float = HOLD_S,
    ) -> None:
        if form not in FORMS:
            raise ConfigurationError(f"form = {form!r} is not known. {near(form, FORMS)}")
        found = shipped_gains(form) if gains is None else (np.asarray(gains, dtype=np.float64), math.inf)
        self.gains, self.heeds_warning = found[0], form != "local"
        if gains is None:
            self.searched_numbers = int(np.count_nonzero(self.gains)) + (detection_mps is None)
        super().__init__(spec, detection_mps=found[1] if detection_mps is None else detection_mps, hold_s=hold_s)
        if self.gains.shape[-2:] != SHAPE:
            raise ValueError(f"gains of shape {SHAPE} or (B, *{SHAPE}) were expected, got {self.gains.shape}")
        self.table = as_records(Gains, self.gains.reshape(-1, SIZE))  # leaders' and others' by turns

    def correct(self, seen: Seen, reasons: BoolArray, corrections: FloatArray) -> None:
        """See the class."""
        config = self.spec.config
        known = (seen["tau_s"], config.vehicles_per_platoon, config.desired_speed_mps, self.limit_mps2, self.table)
        _control(seen.observation, self.layout, reasons, *known, self.heeds_warning, corrections)


@kernel
def _control(
    observation: Observation,
    layout: Layout,
    reasons: BoolArray,
    tau_s: FloatArray,
    vehicles_per_platoon: int,
    desired_speed_mps: float,
    limit_mps2: float,
    gains: Array,
    listens: bool,
    corrections: FloatArray,
) -> None:
    sight = sight_for(corrections.shape[1])
    for b in range(corrections.shape[0]):
        look(borrowed(observation)[b], lend(layout), borrowed(reasons)[b], sight)
        mine = 2 * (b % (gains.size // 2))
        leader, other = unpack(Gains, gains, mine), unpack(Gains, gains, mine + 1)
        road = (vehicles_per_platoon, tau_s[b], desired_speed_mps, limit_mps2)
        follow_all(sight, leader, other, road, listens, borrowed(corrections)[b])


@inlined
def follow_all(
    sight: Sight,
    leader: Gains,
    other: Gains,
    road: Road,
    listens: bool,
    corrections: FloatArray,
) -> None:
    """Write the corrections (M,) in m/s2 of all that act, front to rear, so that each knows its predecessor's."""
    size, tau_s, desired_speed_mps, limit_mps2 = road
    for q in range(1, corrections.size):
        if sight.mitigable[q]:
            own = leader if q % size == 0 else other
            wanted = follow(sight, q, own, tau_s, desired_speed_mps, listens)
            wanted += own.predecessor_command * (sight.law_command[q - 1] + corrections[q - 1])
            corrections[q] = clip(wanted, -limit_mps2, limit_mps2)


@inlined
def follow(sight: Sight, q: int, g: Gains, tau_s: float, desired_speed_mps: float, listens: bool) -> float:
    """The correction (m/s2) of vehicle `q`."""
    speed = sight.speed[q]
    u = g.gap * clip(sight.gap[q] - g.wanted_m - g.headway_s * speed, -g.reach_m, g.reach_m)
    u += (g.closing + g.closing_lag * tau_s) * sight.relative_speed[q]
    u += (g.predecessor + g.predecessor_lag * tau_s) * sight.acceleration[q - 1] + g.own * sight.acceleration[q]
    if listens and sight.age_s[q] < np.inf:
        told = g.ahead_closing * (sight.ahead_speed[q] - speed) + g.ahead_acceleration * sight.ahead_acceleration[q]
        u += (told + g.ahead_command * sight.ahead_command[q]) / (1.0 + g.forgetting * sight.age_s[q])
    u = min(u, g.cap * (desired_speed_mps + g.excess_mps - speed))
    return float(u - (1.0 + g.law) * sight.law_command[q])


def local(spec: RoleSpec, detection_mps: float | None = None, hold_s: float = HOLD_S) -> StringController:
    """Plays `string` without radio: jamming cannot harm it, but it relies on its own detection alone."""
    return StringController(spec, form="local", detection_mps=detection_mps, hold_s=hold_s)
