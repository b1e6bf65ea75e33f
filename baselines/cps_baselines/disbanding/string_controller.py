"""Extension beyond the paper: a controller of few numbers for every vehicle, found by `string_search`.

It sets the gap itself instead of correcting towards x_d: what is to be found is how closely vehicles may follow one
another behind human drivers, and how much of what the warning says to use.

For searches that play it thousands of times the whole closed loop is one kernel. Physics, observation and controller
are the functions of the game and of the policy, in the order of a match, so that the episodes are those of a match.
What is saved is the way through Python at every decision.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple, TypeAlias

import numpy as np

from cps_baselines.disbanding.corrections import (
    HOLD_S,
    ActionTrigger,
    Corrections,
    Layout,
    Sight,
    decoded,
    look,
    mark_reasons,
    sight_for,
)
from cps_envs.core.adapter import advises
from cps_envs.core.errors import ConfigurationError, near
from cps_envs.core.fields import encode_row
from cps_envs.core.kernels import borrowed, clip, fill, inlined, kernel, lend, record_type, unpack, view
from cps_envs.core.policy import Generators, RoleSpec
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, IntArray, Observation, Role
from cps_envs.disbanding.attack import disband
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.dynamics import advance_episode, command_by_law
from cps_envs.disbanding.events import advance_eventfully
from cps_envs.disbanding.game import DisbandingGame
from cps_envs.disbanding.observation import fill_defender
from cps_envs.disbanding.payoff import Rules
from cps_envs.disbanding.state import Constants, State
from cps_envs.disbanding.turn import Account, settle


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
    """Lets each vehicle choose its own gap, by searched gains: one set for leaders, one for all others.

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
        rows = np.ascontiguousarray(self.gains.reshape(-1, SIZE))
        self.table: Array = rows.view(record_type(Gains))[:, 0]  # leaders' and others' by turns

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


class StringLoop(DisbandingGame):
    """The disbanding game in which `string` is the defender by itself; let a match play the attacker alone.

    `table` and `slow_mps` of the policy have one set of numbers for all episodes, or one per episode.
    """

    def __init__(self, config: DisbandingConfig, num_envs: int, policy: StringController) -> None:
        super().__init__(config, num_envs)
        self._alarms = np.zeros((num_envs, config.max_vehicles))
        self._policy = policy

    def unplayed(self, num_envs: int) -> DisbandingGame:
        """Planners bring a defender of their own."""
        return DisbandingGame(self.config, num_envs)

    def _reset(self, envs: BoolArray, generators: Generators) -> None:
        super()._reset(envs, generators)
        self._alarms[envs] = 0.0

    def _advance(self, actions: Mapping[Role, Array], envs: BoolArray, num_steps: int) -> FloatArray:
        targets, before = actions.get("attacker", self._waiting), self._account.total.copy()
        p = self._policy
        seen, numbers = (p.layout, p.watch, p.slow_mps), (p.table, p.limit_mps2)
        drive(*self._known, targets, *seen, *numbers, self._alarms, envs, num_steps)
        if self.config.on_collision == "end":
            self.terminated |= self.state.collided_intact.any(axis=1)
        return self._account.total - before


@kernel
def drive(
    state: State,
    constants: Array,
    account: Account,
    metrics: Array,
    rules: Array,
    targets: IntArray,
    layout: Layout,
    watch: Array,
    slow_mps: FloatArray,
    gains: Array,
    limit_mps2: float,
    alarms: FloatArray,
    envs: BoolArray,
    num_periods: int,
) -> None:
    """Disband `targets` (B,) where legal, and drive marked environments through control periods, see `turn.step`.

    The defender decides before it can know of an attack of the same moment, as in a match.
    """
    r, w, vehicles = unpack(Rules, rules, 0), unpack(ActionTrigger, watch, 0), alarms.shape[1]
    sight, reasons, room = sight_for(vehicles), np.zeros(vehicles, np.bool_), np.empty((4, vehicles))
    row, encoded = np.empty(layout.scale.shape[1]), np.empty(layout.scale.shape[1], np.float32)
    for b in range(envs.size):
        if envs[b]:
            episode, c, own = view(state, b), unpack(Constants, constants, b), view(account, b)
            mine, slow, seen = 2 * (b % (gains.size // 2)), slow_mps[b % slow_mps.size], lend(layout)
            leader, other = unpack(Gains, gains, mine), unpack(Gains, gains, mine + 1)
            gap, closing, law, correction = room[0], room[1], room[2], room[3]
            for period in range(num_periods):
                command_by_law(episode, c, gap, closing, law)
                fill(row, 0.0)
                fill_defender(episode, c, gap, closing, law, borrowed(metrics)[b], row, seen.offsets[0])
                encode_row(row, seen.scale, encoded)
                mark_reasons(encoded, seen, w, slow, borrowed(alarms)[b], reasons)
                decide(encoded, seen, reasons, sight, leader, other, w, c, limit_mps2, correction)
                if period == 0:
                    disband(episode, c, targets[b], own.budget, own.legal)
                if r.eventful:
                    advance_eventfully(episode, c, correction, closing, c.period_steps)
                else:
                    advance_episode(episode, c, correction, closing, c.period_steps)
            settle(episode, c, own, borrowed(metrics)[b], r)


@inlined
def decide(
    encoded: Observation,
    layout: Layout,
    reasons: BoolArray,
    sight: Sight,
    leader: Gains,
    other: Gains,
    w: ActionTrigger,
    c: Constants,
    limit_mps2: float,
    correction: FloatArray,
) -> None:
    """Fill the corrections (M,) in m/s2 that the policy's actions stand for, given its observation."""
    fill(correction, 0.0)
    look(encoded, layout, reasons, sight)
    tau_s = decoded(encoded, layout.scale, layout.offsets[0].tau_s)
    road = (c.vehicles_per_platoon, tau_s, c.desired_speed_mps, limit_mps2)
    follow_all(sight, leader, other, road, w.heeds_warning, correction)
    for q in range(correction.size):
        correction[q] = limit_mps2 * clip(correction[q] / limit_mps2, -1.0, 1.0)
