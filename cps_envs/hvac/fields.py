"""What each role observes: names, units and fixed bounds. `observation.py` fills the values in the same order."""

from __future__ import annotations

from cps_envs.core.fields import Field, Fields
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.model import AHEAD_H
from cps_envs.hvac.sensors import sensor_sets

NEAR_C = 10.0  # temperatures are shown within this of the reference
MAX_LOG = 8.0  # of ln(1 + J / eps)


def _clock(config: HvacConfig) -> tuple[Field, ...]:
    return (
        Field("elapsed_h", "h", 0, config.duration_h, (), "since midnight of the first day"),
        Field("time_of_day", "-", -1, 1, (2,), "sine and cosine of the 24 h angle"),
    )


def _temperature(config: HvacConfig, name: str, shape: tuple[int, ...], meaning: str) -> Field:
    return Field(name, "C", config.reference_c - NEAR_C, config.reference_c + NEAR_C, shape, meaning)


def _readings(config: HvacConfig, name: str, meaning: str) -> Field:
    return Field(name, "C", config.sensor_low_c, config.sensor_high_c, (config.num_sensors,), meaning)


def _loop(config: HvacConfig) -> tuple[Field, ...]:
    """What the control loop does, and what the residuals say."""
    zones, sets = config.num_zones, len(sensor_sets(config))
    return (
        _readings(config, "reading", "what each sensor shows now, forged or not"),
        Field("residual", "ln(1 + J/eps)", 0, MAX_LOG, (sets,), "of each set now, (4.32); 0 until `ready`"),
        Field("mean_residual", "ln(1 + J/eps)", 0, MAX_LOG, (sets,), "since the window is full, (4.33)"),
        Field("last_choice", "-", 0, 1, (sets + 2,), "of the defender one step ago, one-hot"),
        _temperature(config, "last_estimate", (zones,), "that the controller got one step ago"),
        Field("heating", "W", 0, config.max_heating_w, (zones,), "of the last step"),
    )


def attacker_fields(config: HvacConfig) -> Fields:
    """The own sensors and the clock; in the white-box view also the true temperatures and the whole control loop."""
    own = (
        _readings(config, "measured", "compromised sensors before forging; the middle of the range for others"),
        Field("compromised", "-", 0, 1, (config.num_sensors,), "the attacker controls the sensor"),
        Field("active", "-", 0, 1, (), "this action forges readings: the next step is not before the onset"),
        Field("attack_h", "h", 0, config.duration_h, (), "age of the attack at the readings that this action forges"),
        *_clock(config),
    )
    if config.attacker_view == "grey":
        return Fields(*own)
    true = _temperature(config, "temperature", (config.num_zones,), "true, of each zone now")
    return Fields(*own, true, *_loop(config))


def defender_fields(config: HvacConfig) -> Fields:
    """The control loop, what every choice would estimate, how the sets compare, and the weather to come."""
    zones, sets = config.num_zones, len(sensor_sets(config))
    coldest = min(config.outdoor_mean_c - config.outdoor_swing_c, config.outdoor_mean_c - 1.0)
    warmest = max(config.outdoor_mean_c + config.outdoor_swing_c, config.outdoor_mean_c + 1.0)
    hours = ", ".join(f"{hour:g}" for hour in AHEAD_H)
    return Fields(
        *_loop(config),
        _temperature(config, "estimate", (sets + 2, zones), "of each choice; all but the first alike until `ready`"),
        Field("better_half", "-", 0, 1, (sets,), "the set is in the better half by its residual (MTD1)"),
        Field("passes", "-", 0, 1, (sets,), "the set's mean residual is at most eps (MTD2)"),
        Field("ready", "-", 0, 1, (), "the window is full: sets can be chosen"),
        Field("samples", "-", 0, config.num_steps, (), "residuals in the means"),
        Field("outdoor_c", "C", coldest, warmest, (len(AHEAD_H),), f"outside temperature {hours} h ahead"),
        *_clock(config),
    )
