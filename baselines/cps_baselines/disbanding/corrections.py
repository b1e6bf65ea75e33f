"""Defenders that correct commands, and the simplest of them: copying the disbanded vehicle ahead."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from cps_envs.core.compute.kernels import Record, borrowed, fill, inlined, kernel, lend, pack, unpack
from cps_envs.core.declare.fields import decode_entry
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, BoolArray, FloatArray, Generators, Knowledge, Observation, State

SPEED_MATCHING = 1.0  # 1/s, chosen; 0.5 to 4 give the same errors within 0.1 points
HALF = 0.5  # of an entry that is 0 or 1
HOLD_S = 3.0  # chosen: an alarm outlasts what set it off, so that a vehicle does not switch to and fro


class Layout(NamedTuple):
    """How an observation of the defender is to be read."""

    offsets: Array  # (1,) see `Fields.offsets`
    scale: FloatArray  # (2, size) see `Fields.scale`


class ActionTrigger(NamedTuple):
    """When a vehicle corrects itself: by warnings or its own detection, and for how long."""

    heeds_warning: bool
    everywhere: bool  # corrections act on every intact vehicle, not only upstream of a disbanded platoon
    vehicles_per_platoon: int
    hold_s: float  # an alarm lasts
    step_s: float  # between two decisions


class Sight(NamedTuple):
    """What a controller reads of one episode in physical units, (M,); the front vehicle has nobody ahead."""

    speed: FloatArray  # m/s
    acceleration: FloatArray  # m/s2
    gap: FloatArray  # m
    relative_speed: FloatArray  # m/s, the predecessor's minus the own
    law_command: FloatArray  # m/s2
    ahead_speed: FloatArray  # m/s, of the nearest disbanded vehicle ahead
    ahead_acceleration: FloatArray  # m/s2, of that vehicle
    ahead_command: FloatArray  # m/s2, of that vehicle
    age_s: FloatArray  # s, of what is known of it; +inf where nothing is
    mitigable: BoolArray  # a correction acts, and the vehicle has a reason for one


class Corrections(AnalyticPolicy):
    """Base of central defenders: one correction in m/s2 for each vehicle.

    Where the warning is relayed, a vehicle acts once it has received a record. With `detection_mps` it acts on what it
    sees, too: while it or its predecessor is slower than the desired speed by more than that, and `hold_s` longer.
    A vehicle that acts without a record takes its predecessor for the disbanded vehicle. `detection_mps` is one number,
    or (B,) with one per episode; at 0 all act at all times, whatever they see.

    Raises:
        ConfigurationError: the environment takes one correction per platoon, or a negative threshold.
    """

    heeds_warning = True  # False: nothing but the own detection makes a vehicle act

    def __init__(self, spec: RoleSpec, *, detection_mps: float | FloatArray = math.inf, hold_s: float = HOLD_S) -> None:
        super().__init__(spec)
        config = spec.config
        if config.defense_action != "vehicle":
            raise ConfigurationError(f'{type(self).__name__} corrects vehicles; it needs defense_action="vehicle"')
        thresholds = np.reshape(detection_mps, (-1, 1))
        if not (thresholds >= 0).all() or not hold_s >= 0:
            raise ConfigurationError(f"detection_mps = {detection_mps} and hold_s = {hold_s} have to be at least 0")
        self.limit_mps2 = config.max_acceleration_mps2 - config.min_acceleration_mps2
        self.layout = Layout(spec.fields.offsets, spec.fields.scale)
        self.slow_mps: FloatArray = np.where(thresholds > 0, config.desired_speed_mps - thresholds, np.inf)[:, 0]
        everywhere, size = config.correctable == "intact", config.vehicles_per_platoon
        self.watch = pack(ActionTrigger(self.heeds_warning, everywhere, size, float(hold_s), spec.decision_interval_s))

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        """How long the alarm of each vehicle lasts still, (B, M) s."""
        return (np.zeros((len(generators), self.spec.config.max_vehicles)),)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        """Actions (B, M): corrections as shares of u_max - u_min; zero where none would act."""
        actions, alarms = np.zeros((len(seen), self.spec.config.max_vehicles)), state[0].copy()
        reasons = np.zeros(actions.shape, np.bool_)
        _watch(seen.observation, self.layout, self.watch, self.slow_mps, alarms, reasons)
        if reasons.any():
            self.correct(seen, reasons, actions)
            np.clip(actions / self.limit_mps2, -1.0, 1.0, out=actions)
        return actions, (alarms, *state[1:])

    @abstractmethod
    def correct(self, seen: Seen, reasons: BoolArray, corrections: FloatArray) -> None:
        """Write the corrections (B, M) in m/s2 of mitigable vehicles that have `reasons` (B, M); others' stay zero."""


@kernel
def _watch(
    observation: Observation,
    layout: Layout,
    watch: Array,
    slow_mps: FloatArray,
    alarms: FloatArray,
    reasons: BoolArray,
) -> None:
    """`mark_reasons` for a batch; `slow_mps` has one number, or one per episode."""
    w = unpack(ActionTrigger, watch, 0)
    for b in range(alarms.shape[0]):
        slow = slow_mps[b % slow_mps.size]
        mark_reasons(borrowed(observation)[b], lend(layout), w, slow, borrowed(alarms)[b], borrowed(reasons)[b])


@inlined
def mark_reasons(
    row: Observation, layout: Layout, w: ActionTrigger, slow_mps: float, alarms: FloatArray, reasons: BoolArray
) -> None:
    """Fill in who has a reason to act (M,), and renew the alarms (M,) in s; below `slow_mps` a vehicle is noticed."""
    fill(reasons, False)
    if slow_mps > -np.inf:
        renew_alarms(row, layout, w, slow_mps, alarms)
        for q in range(reasons.size):
            reasons[q] = alarms[q] > 0.0
    if w.heeds_warning:
        mark_told(row, layout, w, reasons)


@inlined
def renew_alarms(row: Observation, layout: Layout, w: ActionTrigger, slow_mps: float, alarms: FloatArray) -> None:
    """Bring the alarms (M,) in s up to what is seen now."""
    at, scale, ahead = layout.offsets[0], layout.scale, False
    for q in range(alarms.size):
        slow = decode_entry(row, scale, at.speed + q) < slow_mps
        alarms[q] = w.hold_s if slow or ahead else max(alarms[q] - w.step_s, 0.0)
        ahead = slow


@inlined
def mark_told(row: Observation, layout: Layout, w: ActionTrigger, reasons: BoolArray) -> None:
    """Add to the reasons (M,) those of vehicles that are told of a disbanded platoon ahead."""
    at, scale, size = layout.offsets[0], layout.scale, w.vehicles_per_platoon
    if at.record_age_s > at.warned:
        for q in range(size, reasons.size):
            reasons[q] = reasons[q] or decode_entry(row, scale, at.warned + q - size) > HALF
        return
    platoons, told = count_present(row, at, scale), False
    for entry in range(at.disbanded, at.ahead_speed):
        told = told or (not w.everywhere and decode_entry(row, scale, entry) > HALF)
    for platoon in range(reasons.size // size):
        i = platoons - 1 - platoon
        disbanded = i >= 0 and decode_entry(row, scale, at.disbanded + i) > HALF
        for q in range(platoon * size, (platoon + 1) * size):
            reasons[q] = reasons[q] or (told and not (w.everywhere and disbanded))
        told = told or disbanded


@inlined
def sight_for(num_vehicles: int) -> Sight:
    """Room for a `Sight`; kernels make it once per call."""
    r, mitigable = np.zeros((9, num_vehicles)), np.zeros(num_vehicles, np.bool_)
    return Sight(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], mitigable)


@inlined
def look(row: Observation, layout: Layout, reasons: BoolArray, sight: Sight) -> None:
    """Fill `sight` from an observation (size,) and the vehicles that have `reasons` (M,) to act."""
    at, scale = layout.offsets[0], layout.scale
    vehicles = sight.speed.size
    first = vehicles - (at.warned - at.mitigable)
    for q in range(vehicles):
        sight.speed[q] = decode_entry(row, scale, at.speed + q)
        sight.acceleration[q] = decode_entry(row, scale, at.acceleration + q)
        sight.law_command[q] = decode_entry(row, scale, at.law_command + q)
    for q in range(1, vehicles):
        sight.gap[q] = decode_entry(row, scale, at.gap + q - 1)
        sight.relative_speed[q] = decode_entry(row, scale, at.relative_speed + q - 1)
    for q in range(first, vehicles):
        sight.mitigable[q] = reasons[q] and decode_entry(row, scale, at.mitigable + q - first) > HALF
    if at.record_age_s > at.warned:
        read_records(row, layout, sight)
    else:
        read_broadcast(row, layout, sight)


@inlined
def read_records(row: Observation, layout: Layout, sight: Sight) -> None:
    """Fill in what each vehicle has been told; the predecessor stands for what it has not."""
    at, scale = layout.offsets[0], layout.scale
    first = sight.speed.size - (at.record_age_s - at.warned)
    for q in range(1, sight.speed.size):
        i = q - first
        if i >= 0 and decode_entry(row, scale, at.warned + i) > HALF:
            sight.ahead_speed[q] = decode_entry(row, scale, at.ahead_speed + i)
            sight.ahead_acceleration[q] = decode_entry(row, scale, at.ahead_acceleration + i)
            sight.ahead_command[q] = decode_entry(row, scale, at.ahead_command + i)
            sight.age_s[q] = decode_entry(row, scale, at.record_age_s + i)
        else:
            suppose(sight, q)


@inlined
def suppose(sight: Sight, q: int) -> None:
    """Take the predecessor of vehicle `q`, of whom it knows, for the disbanded vehicle, of whom it does not."""
    before = max(q - 1, 0)
    sight.ahead_speed[q], sight.age_s[q] = sight.speed[before], np.inf
    sight.ahead_acceleration[q] = sight.ahead_command[q] = sight.acceleration[before]


@inlined
def read_broadcast(row: Observation, layout: Layout, sight: Sight) -> None:
    """Fill in what the broadcast tells each platoon."""
    at, scale = layout.offsets[0], layout.scale
    size = sight.speed.size // (at.ahead_speed - at.disbanded)
    platoons = count_present(row, at, scale)
    told = False
    for q in range(size):
        suppose(sight, q)
    for platoon in range(1, platoons):
        i = platoons - 1 - platoon
        told = told or decode_entry(row, scale, at.disbanded + i + 1) > HALF
        speed, command = decode_entry(row, scale, at.ahead_speed + i), decode_entry(row, scale, at.ahead_command + i)
        acceleration = decode_entry(row, scale, at.ahead_acceleration + i)
        for q in range(platoon * size, (platoon + 1) * size):
            if told:
                sight.ahead_speed[q], sight.ahead_acceleration[q], sight.ahead_command[q] = speed, acceleration, command
                sight.age_s[q] = 0.0
            else:
                suppose(sight, q)


@inlined
def count_present(row: Observation, at: Record, scale: FloatArray) -> int:
    """How many platoons there are: all, unless their number is drawn and seen."""
    count = 0
    for entry in range(at.present, at.time_s):
        count += decode_entry(row, scale, entry) > HALF
    return count if at.time_s > at.present else at.ahead_speed - at.disbanded


class CopyDisbanded(Corrections):
    """Makes every vehicle copy the command of the nearest disbanded vehicle ahead. Not in the paper.

    Needs a broadcast of that command and of that vehicle's speed. Copying keeps the gaps of the steady state, and its
    error is that of the vehicle copied, whatever the number of platoons. A bounded correction cannot follow a driver
    who commands -90 m/s2, so the speed that is lost at first is matched again at `SPEED_MATCHING`.
    """

    def correct(self, seen: Seen, reasons: BoolArray, corrections: FloatArray) -> None:
        """The copied command, with the speeds matched, minus the controller's."""
        _copy_disbanded(seen.observation, self.layout, reasons, corrections)


@kernel
def _copy_disbanded(observation: Observation, layout: Layout, reasons: BoolArray, corrections: FloatArray) -> None:
    sight = sight_for(corrections.shape[1])
    for b in range(corrections.shape[0]):
        look(borrowed(observation)[b], lend(layout), borrowed(reasons)[b], sight)
        for q in range(corrections.shape[1]):
            if sight.mitigable[q]:
                lag = sight.ahead_speed[q] - sight.speed[q]
                corrections[b, q] = sight.ahead_command[q] + SPEED_MATCHING * lag - sight.law_command[q]
