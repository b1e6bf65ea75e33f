"""The heated building without attack, noise or what the model does not know: does it get to its set-points?"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cps_envs.core.declare.config import of_bodies, over_time
from cps_envs.core.types import BoolArray, FloatArray, IntArray
from cps_envs.hvac.building import discretise, places_of, weather
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.controller import control_of, feedforward
from cps_envs.hvac.parameters import LEAST_WEIGHT, fitting_weight

SHORTEST_H = 6.0  # of an episode that is judged
MOST_DAYS = 8  # of a series, evenly spread


class Outcome(NamedTuple):
    """What is left in the second half of the days, by zones."""

    error_c: FloatArray  # (D, n) median distance to the set-point, C
    too_cold: BoolArray  # (D, n) the plant is at its highest power for most of that time
    too_warm: BoolArray  # (D, n) at its lowest


def undisturbed(config: HvacConfig) -> Outcome:
    """Days of the nominal closed loop (4.18), whose controller gets the true temperatures; D of a series, else one."""
    building, n, K = discretise(config), config.num_zones, config.num_steps
    places = places_of(config)
    times_s: FloatArray = places.begin_s + config.step_s * np.arange(places.steps, dtype=np.float64)
    w, reference = weather(config, times_s), over_time(config, "reference_c", times_s, n)
    first = _days(places.first, places.counts)
    control = control_of(config)
    ahead = feedforward(control, w, reference, int(first.max()) + K)
    least, most = of_bodies(config.min_heating_w, n), of_bodies(config.max_heating_w, n)
    x = np.full((len(first), n), config.initial_c)
    before, u = x, np.zeros_like(x).clip(least, most)
    errors, heating = np.empty((K, *x.shape)), np.empty((K, *x.shape))
    for k in range(K):
        now = first + k
        errors[k] = np.abs(x - reference[now])
        moved = (reference[now] - x) @ control.K_e.T - (x - before) @ control.K_d.T - ahead[now]
        u = heating[k] = (u + moved).clip(least, most)
        before, x = x, x @ building.A.T + building.B * u + building.G * w[now]
    late, slack = slice(K // 2, None), 1e-3 * (most - least)
    return Outcome(
        np.median(errors[late], axis=0),
        (heating[late] >= most - slack).mean(axis=0) > 0.5,
        (heating[late] <= least + slack).mean(axis=0) > 0.5,
    )


@lru_cache(maxsize=64)
def unheated(config: HvacConfig) -> str:
    """A sentence on what keeps a building from its set-points without any attack; empty where nothing does.

    A zone gets there if its median error in the second half of the day is at most `comfort_c`.
    """
    if config.duration_h < SHORTEST_H:
        return ""
    found = undisturbed(config)
    wrong = found.error_c > config.comfort_c
    if not wrong.any():
        return ""
    day, zone = np.unravel_index(int(found.error_c.argmax()), found.error_c.shape)
    missed = (
        f"zone {zone + 1} stays {found.error_c[day, zone]:.3g} C off its set-point for half a day without any attack"
    )
    return f"{missed}{_of_days(wrong)}: {_limited(config, found, wrong) or _slow(config)}"


def _limited(config: HvacConfig, found: Outcome, wrong: BoolArray) -> str:
    """Which limit of the plant keeps it from a set-point; empty if none does."""
    if (wrong & found.too_cold).any():
        return f"raise max_heating_w = {config.max_heating_w}, which is all that its plant has"
    if (wrong & found.too_warm).any():
        return f"lower min_heating_w = {config.min_heating_w}, so that its plant can cool more"
    return ""


def _slow(config: HvacConfig) -> str:
    """What to change where the plant could and the controller does not."""
    fitting = fitting_weight(config.heat_capacity_j_per_k)
    weights = [w for w in (fitting, fitting / 10, fitting / 100) if LEAST_WEIGHT <= w < config.move_weight]
    slow = f"move_weight = {config.move_weight:g} C2/W2 makes the controller too slow for it"
    for weight in weights:
        better = replace(config, move_weight=weight)
        found = undisturbed(better)
        if not (wrong := found.error_c > config.comfort_c).any():
            return f"{slow}, and {weight:.3g} fits"
        if limited := _limited(better, found, wrong):
            return f"{slow}, where {weight:.3g} fits; and {limited}"
    ahead_h = config.prediction_steps * config.step_s / 3600
    return f"the controller looks {ahead_h:.3g} h ahead: change prediction_steps, step_s or move_weight"


def _days(first: IntArray, counts: IntArray) -> IntArray:
    """Up to `MOST_DAYS` of the samples at which episodes may begin (2, m)."""
    every = np.unique(np.concatenate([row[:count] for row, count in zip(first, counts, strict=True)]))
    return every[np.unique(np.linspace(0, len(every) - 1, MOST_DAYS).astype(np.int64))]


def _of_days(wrong: BoolArray) -> str:
    days = len(wrong)
    return f", on {int(wrong.any(axis=1).sum())} of the {days} days that were looked at" if days > 1 else ""
