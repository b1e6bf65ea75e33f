"""Algorithm 2 against a platoon at rest, in closed loop and without limits on the commands, as in Fig. 3.2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cps_baselines.fdi.branch_and_bound import CORRECTED, find_injections, make_search
from cps_envs.core.types import BoolArray, FloatArray
from cps_envs.fdi.config import FdiConfig

TOUCH_M = 1e-7  # a gap this small is closed


class Collision(NamedTuple):
    """The first sample at which a gap is closed."""

    pair: int  # rear vehicle; the lead's pair is the one with its virtual reference
    time_s: float
    impact_speed_mps: float  # relative speed, closing < 0


def pair_name(pair: int) -> str:
    """Pair i with the vehicle ahead of it."""
    return f"{pair}-{pair + 1}"


@dataclass(frozen=True)
class CollisionCourse:
    """What happened; K samples up to the collision or the end."""

    gap_m: FloatArray  # (K, n) separations
    relative_speed_mps: FloatArray  # (K, n)
    injection: FloatArray  # (K - 1, q) m for ranges, m/s for range-rates
    lowest_reading_m: float | None  # of the attacked range sensor, never below 0 physically; None where not attacked
    infeasible_calls: int  # searches that found no sequence, so that nothing was injected
    dt_s: float
    collision: Collision | None

    @property
    def time_s(self) -> FloatArray:
        """The samples' times (K,)."""
        return np.arange(len(self.gap_m), dtype=np.float64) * self.dt_s


def attack_course(
    config: FdiConfig,
    vehicle: int,
    kind: str,
    *,
    steps_ahead: int = 0,
    width: int = 0,
    gap_sign: float = CORRECTED,
    ignored_pair: int | None = None,
) -> CollisionCourse:
    """Attack one vehicle from rest until a gap closes or the horizon ends; see `make_search` for the options.

    A sequence is applied as a whole before the next search: applying only its first injection, the least that starts
    any sequence, takes up to three times as long. `ignored_pair` may collide without ending the course.

    Raises:
        ConfigurationError: no such vehicle or kind, or a negative number.
    """
    search = make_search(config, vehicle, kind, steps_ahead, width=width, gap_sign=gap_sign)
    watched = np.arange(1, config.num_vehicles + 1) != ignored_pair
    resolution = np.array([config.range_resolution_m, config.rate_resolution_mps])[[kind != "v", "v" in kind]]
    errors, injections, waiting = [np.zeros(2 * config.num_vehicles)], list[FloatArray](), list[FloatArray]()
    infeasible, collision = 0, None
    while collision is None and len(injections) < config.horizon:
        if not waiting:
            planned = find_injections(search, errors[-1][np.newaxis])
            waiting = list(planned.levels[0] * resolution)
            infeasible += not planned.found[0]
        injections.append(waiting.pop(0))
        errors.append(config.model.transition @ errors[-1] + search.effect @ injections[-1])
        collision = _collision(errors[-1], watched, len(injections), config)
    return _course(np.array(errors), np.array(injections), config, vehicle, kind, infeasible, collision)


def _course(
    errors: FloatArray,
    injections: FloatArray,
    config: FdiConfig,
    vehicle: int,
    kind: str,
    infeasible_calls: int,
    collision: Collision | None,
) -> CollisionCourse:
    gap_m = errors[:, : config.num_vehicles] + config.desired_gap_m
    shown_m = gap_m[:-1, vehicle - 1] + injections[:, 0] if "x" in kind else None
    return CollisionCourse(
        gap_m=gap_m,
        relative_speed_mps=errors[:, config.num_vehicles :],
        injection=injections,
        lowest_reading_m=None if shown_m is None else float(shown_m.min()),
        infeasible_calls=infeasible_calls,
        dt_s=config.dt_s,
        collision=collision,
    )


def _collision(error: FloatArray, watched: BoolArray, step: int, config: FdiConfig) -> Collision | None:
    """The watched pair that is deepest inside the other at this sample."""
    n = config.num_vehicles
    closed = np.flatnonzero(watched & (error[:n] <= -config.desired_gap_m + TOUCH_M))
    if not len(closed):
        return None
    pair = closed[np.argmin(error[closed])]
    return Collision(int(pair) + 1, step * config.dt_s, float(error[n + pair]))
