"""What each role observes: names, units and fixed bounds. `observation.py` fills the values in the same order."""

from __future__ import annotations

from cps_envs.core.fields import Field, Fields
from cps_envs.fdi.config import FdiConfig

MAX_RATE_MPS = 20.0
MAX_ERROR_GAPS = 4.0  # gap errors are shown within four desired gaps
MAX_COMMAND_SHARE = 4.0  # the law's wish is shown within four times the limit


def is_drawn(config: FdiConfig) -> bool:
    """Whether resets draw the task."""
    return bool(config.tasks)


def num_slots(config: FdiConfig) -> int:
    """How many injections an action has: one for each attacked sensor, or for every sensor where tasks are drawn."""
    return 2 * config.num_vehicles if is_drawn(config) else config.fixed_task.sensors.count


def attacker_fields(config: FdiConfig) -> Fields:
    """The true errors of every pair, vehicle 1 (last) first, what the law makes of them, and the task."""
    n, slots = config.num_vehicles, num_slots(config)
    furthest = MAX_ERROR_GAPS * config.desired_gap_m
    strongest = MAX_COMMAND_SHARE * max(config.max_acceleration_mps2, -config.min_acceleration_mps2)
    task = (
        Field("attacked", "-", 0, 1, (2 * n,), "sensors under attack: ranges of vehicles 1..n, then range-rates"),
        Field("target", "-", 0, 1, (n,), "one-hot: the vehicle that is to hit the one ahead"),
    )
    return Fields(
        Field("gap_error", "m", -furthest, furthest, (n,), "e_x,i: gap ahead of vehicle i minus x_d"),
        Field("relative_speed", "m/s", -MAX_RATE_MPS, MAX_RATE_MPS, (n,), "e_v,i, negative when closing"),
        Field("command", "m/s2", -strongest, strongest, (n,), "of the law (3.7) without injection"),
        Field("injection", "-", -1, 1, (slots,), "last one, as share of d_max"),
        Field("steps_left", "steps", 0, config.horizon, (), "until the horizon"),
        *(task if is_drawn(config) else ()),
    )


def defender_fields(config: FdiConfig) -> Fields:
    """What the sensors reported in the last step and what a model expected; never the true errors."""
    n = config.num_vehicles
    furthest = config.max_range_injection_m + MAX_ERROR_GAPS * config.desired_gap_m
    fastest = config.max_rate_injection_mps + MAX_RATE_MPS
    strongest = max(config.max_acceleration_mps2, -config.min_acceleration_mps2)
    shared = Field(
        "redundancy_residual", "m", -furthest, furthest, (n - 1,), "range of vehicle i minus rear range of vehicle i+1"
    )
    return Fields(
        Field("range_error", "m", -furthest, furthest, (n,), "reported range minus x_d"),
        Field("range_rate", "m/s", -fastest, fastest, (n,), "reported range-rate"),
        Field("range_innovation", "m", -furthest, furthest, (n,), "reported minus predicted range"),
        Field("rate_innovation", "m/s", -fastest, fastest, (n,), "reported minus predicted range-rate"),
        Field("kinematic_residual", "m", -furthest, furthest, (n,), "change of range minus mean range-rate times dt"),
        *((shared,) if config.share_rear_range else ()),
        Field("command", "m/s2", -strongest, strongest, (n,), "applied in the last step"),
        Field("trust", "-", 0, 1, (2 * n,), "1 where the last reading was used: ranges 1..n, then range-rates"),
        Field("steps_left", "steps", 0, config.horizon, (), "until the horizon"),
    )
