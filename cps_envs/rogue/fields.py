"""What the attacker, the central defender, and a single vehicle of the swarm form observe: names, units and bounds."""

from __future__ import annotations

import numpy as np

from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.fields import Field, Fields
from cps_envs.core.types import FloatArray
from cps_envs.rogue.actions import choices_of
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.controllers import DRIVEN
from cps_envs.rogue.formation import FAR

RATE_MPS = 25.0
MAX_SPEED_MPS = 100.0  # what the paper's engine can hold at twice the power
ACCELERATION_MPS2 = 10.0
MAX_REFERENCE_MPS = 60.0
MAX_RATIO = 3.0
MAX_ONSET_S = 60.0
DETECTOR_SPAN = 3.0  # alarm thresholds
NEAR = 0.2  # m or m/s, chosen: below the noise in `learning`; up to it `compressed` errors are in proportion


def attacker_fields(config: RogueConfig) -> Fields:
    """The seized vehicle's own sensors; a side without a neighbour reads zero.

    Where several attack together there is an entry for each of them, from the rear.
    """
    far, seats = FAR * config.separation_m, seats_of(config)
    return Fields(
        Field("front_gap_error", "m", -far, far, seats, "distance to the vehicle ahead minus sigma"),
        Field("front_gap_rate", "m/s", -RATE_MPS, RATE_MPS, seats, "speed of the vehicle ahead minus own"),
        Field("rear_gap_error", "m", -far, far, seats, "distance to the vehicle behind minus sigma"),
        Field("rear_gap_rate", "m/s", -RATE_MPS, RATE_MPS, seats, "own speed minus that of the vehicle behind"),
        Field("speed", "m/s", 0, MAX_SPEED_MPS, seats, "own"),
        Field("effort", "-", config.min_effort, config.max_effort, seats, "own, in the last integration step"),
        Field("reference_speed", "m/s", 0, MAX_REFERENCE_MPS, (), "v_ref"),
        Field("power_ratio", "-", 1, MAX_RATIO, (), "own alpha over that of the others"),
        Field("attacker_index", "-", 1, config.max_vehicles, seats, "of the seized vehicle, 1 = rear"),
        Field("num_vehicles", "-", 1, config.max_vehicles, () if drawn(config) else (0,), "of the platoon"),
        Field("until_onset_s", "s", 0, MAX_ONSET_S, (), "until the own effort takes effect"),
        Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
    )


def seats_of(config: RogueConfig) -> tuple[int, ...]:
    """The shape of what is said of the seized vehicle: a number, or (k,) where k of them attack together."""
    return () if config.num_seized == 1 else (config.num_seized,)


def compressed(error: FloatArray) -> FloatArray:
    """arsinh(error / `NEAR`), error in m or m/s: in proportion where it is small, a logarithm where it is large."""
    shown: FloatArray = np.arcsinh(error / NEAR)
    return shown


def drawn(config: RogueConfig) -> bool:
    """Whether each episode draws how many vehicles there are."""
    return bounds(config.num_vehicles)[0] < config.max_vehicles


def watches_rear(config: RogueConfig) -> int:
    """Number of intact vehicles that may have somebody behind them; the others come first."""
    return config.num_intact - (config.seat_range[0] > 1)


def watches_ahead(config: RogueConfig) -> int:
    """Number of intact vehicles that may have somebody ahead of them; the others come last."""
    return config.num_intact - (not config.leader_may_be_seized)


def defender_fields(config: RogueConfig) -> Fields:
    """Pairs and vehicles from the rear to the leader; `ordered` vehicles are those that get orders.

    Pair i is vehicle i and the one ahead of it. The ordered vehicles are those without the seized ones. If the last of
    them is certainly the leader, it has no front detector. If the first is certainly the rear one, it has no rear
    detector. With `orders="all"` all vehicles are ordered and nothing marks a seized one: it reports the alarm, growth
    and law of an intact vehicle in its place. Then alarms are reported and the detectors behind them are not. What
    belongs to vehicles that an episode does not have is zero.
    """
    n, ordered, far = config.max_vehicles, config.num_orders, FAR * config.separation_m
    watches_front, watched = (0, 0) if config.hidden else (watches_ahead(config), watches_rear(config))
    spread, seats = DETECTOR_SPAN * config.alarm_threshold, seats_of(config)
    growths, laws = ((ordered,), (ordered, len(DRIVEN))) if choices_of(config) else ((0,), (0,))
    return Fields(
        Field("gap_error", "m", -far, far, (n - 1,), "of each pair, distance minus sigma"),
        Field("gap_rate", "m/s", -RATE_MPS, RATE_MPS, (n - 1,), "of each pair"),
        Field("speed", "m/s", 0, MAX_SPEED_MPS, (n,), "of each vehicle"),
        Field("acceleration", "m/s2", -ACCELERATION_MPS2, ACCELERATION_MPS2, (n,), "of each vehicle"),
        Field("reference_error", "m", -far, far, (), "reference minus the leader's position"),
        Field("reference_speed", "m/s", 0, MAX_REFERENCE_MPS, (), "v_ref"),
        Field("front_detector", "m2/s3", 0, spread, (watches_front,), "z_f of the intact vehicles but the leader"),
        Field("rear_detector", "m2/s3", 0, spread, (watched,), "z_r of those with somebody behind"),
        Field("alarm", "-", -1, 1, (ordered,), "1: front neighbour detected, -1: rear one, 0: none; latched"),
        Field("growth", "m", 0, config.max_growth_m, growths, "separation set-point minus sigma"),
        Field("law", "-", 0, 1, laws, f"law in force, one-hot: {', '.join(DRIVEN)}"),
        Field("attacker_index", "-", 1, n, (0,) if config.hidden else seats, "of the seized vehicle, 1 = rear"),
        Field(
            "present", "-", 0, 1, (n - int(bounds(config.num_vehicles)[0]),), "of the last vehicles: there are so many"
        ),
        Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
    )


def vehicle_fields(config: RogueConfig) -> Fields:
    """The own row of one vehicle with orders in the swarm form: its own sensors and its own detectors.

    The row of a vehicle that an episode does not have is zero but for the time.
    """
    far, spread = FAR * config.separation_m, DETECTOR_SPAN * config.alarm_threshold
    growths, laws = ((), (len(DRIVEN),)) if choices_of(config) else ((0,), (0,))
    return Fields(
        Field("leads", "-", 0, 1, (), "the vehicle is the leader, whose front neighbour is the reference"),
        Field("trails", "-", 0, 1, (), "nobody is behind"),
        Field("front_gap_error", "m", -far, far, (), "distance ahead minus sigma; the leader's to its reference"),
        Field("front_gap_rate", "m/s", -RATE_MPS, RATE_MPS, (), "speed ahead minus own; the leader's to v_ref"),
        Field("rear_gap_error", "m", -far, far, (), "distance behind minus sigma; 0 if nobody is behind"),
        Field("rear_gap_rate", "m/s", -RATE_MPS, RATE_MPS, (), "own speed minus that behind; 0 if nobody is behind"),
        Field("speed", "m/s", 0, MAX_SPEED_MPS, (), "own"),
        Field("reference_speed", "m/s", 0, MAX_REFERENCE_MPS, (), "v_ref"),
        Field("front_acceleration", "m/s2", -ACCELERATION_MPS2, ACCELERATION_MPS2, (), "ahead; 0 for the leader"),
        Field("rear_acceleration", "m/s2", -ACCELERATION_MPS2, ACCELERATION_MPS2, (), "behind; 0 if nobody is"),
        Field("front_detector", "m2/s3", 0, spread, (), "own z_f"),
        Field("rear_detector", "m2/s3", 0, spread, (), "own z_r"),
        Field("alarm", "-", -1, 1, (), "1: front neighbour detected, -1: rear one, 0: none; latched"),
        Field("growth", "m", 0, config.max_growth_m, growths, "own separation set-point minus sigma"),
        Field("law", "-", 0, 1, laws, f"own law in force, one-hot: {', '.join(DRIVEN)}"),
        Field("time_left_s", "s", 0, config.duration_s, (), "until the end of the episode"),
    )
