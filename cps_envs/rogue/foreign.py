"""Numbers of a configuration that fit the vehicles of Table 5.1 and are used for others."""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from math import pi

from cps_envs.core.declare.bodies import spans
from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.foreign import other_fields, too_late
from cps_envs.rogue.config import PAPER, PRESETS, RogueConfig
from cps_envs.rogue.stability import linear_radius

FACTOR = 1.25  # by which a limit may lie off what the vehicles can do
REACHED = (5.0 * 2.0) ** 2 / (2.0 * pi * 0.01)  # m2/s3, the same of the vehicles and the detector of Table 5.1
ENGINE = ("drive_mps2", "drag_per_s", "max_effort", "min_effort", "max_speed_mps", "max_acceleration_mps2")
DETECTION = (*ENGINE, "alarm_threshold", "detector_cutoff_hz")
LINEAR = ("num_vehicles", "proportional_gain", "derivative_gain", "dt_s")


@lru_cache(maxsize=64)
def foreign(config: RogueConfig) -> tuple[str, ...]:
    """A sentence for each kind of number that is of other vehicles."""
    found = [too_late(config, "onset_s", config.duration_s, "duration_s")]
    if other_fields(config, PRESETS, DETECTION):
        found += [_limits(config), _alarm(config)]
    if other_fields(config, PRESETS, LINEAR):
        found.append(_linear(config))
    return tuple(each for each in found if each)


def _limits(config: RogueConfig) -> str:
    """Limits that the sliding mode reckons with and that follow from engine and drag: alpha F+ and alpha F+ / beta."""
    push = spans(config.drive_mps2) * config.max_effort
    drag = spans(config.drag_per_s)
    able = {
        "max_acceleration_mps2": (float(push.min()), float(push.max()), "m/s2"),
        "max_speed_mps": (float((push[0] / drag[1]).min()), float((push[1] / drag[0]).max()), "m/s"),
    }
    wrong = [n for n, (low, high, _) in able.items() if not low / FACTOR <= getattr(config, n) <= high * FACTOR]
    if not wrong:
        return ""
    given = " and ".join(f"{name} = {getattr(config, name):g} {able[name][2]}" for name in wrong)
    fit = ", ".join(f"{name}={able[name][1]:.4g}" for name in wrong)
    return f"{given}, by which the sliding mode reckons, {_are(wrong)} of other engines than here: give {fit}"


def _alarm(config: RogueConfig) -> str:
    """A threshold that no attack can pass: the largest squared residual for ever, in a detector that leaks."""
    most = float(spans(config.drive_mps2).max()) * (config.max_effort - config.min_effort)
    most *= bounds(config.power_ratio)[1]
    reached = most * most / (2.0 * pi * config.detector_cutoff_hz)
    if reached > config.alarm_threshold:
        return ""
    fit = PAPER.alarm_threshold * reached / REACHED
    return (
        f"alarm_threshold = {config.alarm_threshold:g} m2/s3 is more than any attack can reach with these engines and "
        f"this detector_cutoff_hz, {reached:.3g}: give about {fit:.2g}"
    )


def _linear(config: RogueConfig) -> str:
    """Gains with which the platoon does not keep together without any attack."""
    gains = product(bounds(config.proportional_gain), bounds(config.derivative_gain))
    worst = max(linear_radius(config.max_vehicles, k_p, k_d, config.dt_s) for k_p, k_d in set(gains))
    if worst < 1.0:
        return ""
    return (
        f"proportional_gain = {config.proportional_gain} and derivative_gain = {config.derivative_gain} let the linear "
        f"controller sway without any attack, with dt_s = {config.dt_s}: change them"
    )


def _are(names: list[str]) -> str:
    return "is" if len(names) == 1 else "are"
