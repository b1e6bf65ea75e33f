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
    kind: str,
    *,
    gap_sign: float = CORRECTED,
    ignored_pair: int | None = None,
) -> CollisionCourse:
    """Attack the lead from rest until a gap closes or the horizon ends, searching one injection at a time.

    `gap_sign` is that of e_x in (3.39). `ignored_pair` may collide without ending the course.

    Raises:
        ConfigurationError: no such kind.
    """
    lead = config.num_vehicles
    search = make_search(config, lead, kind, gap_sign=gap_sign)
    watched = np.arange(1, lead + 1) != ignored_pair
    resolution = np.array([config.range_resolution_m, config.rate_resolution_mps])[[kind != "v", "v" in kind]]
    errors, injections = [np.zeros(2 * config.num_vehicles)], list[FloatArray]()
    infeasible, collision = 0, None
    while collision is None and len(injections) < config.horizon:
        planned = find_injections(search, errors[-1][np.newaxis])
        infeasible += not planned.found[0]
        injections.append(planned.levels[0, 0] * resolution)
        errors.append(config.model.transition @ errors[-1] + search.effect @ injections[-1])
        collision = _collision(errors[-1], watched, len(injections), config)
    gap_m, relative_speed_mps = np.split(np.array(errors), 2, axis=1)
    gap_m += config.desired_gap_m
    injection = np.array(injections)
    lowest_m = float((gap_m[:-1, lead - 1] + injection[:, 0]).min()) if "x" in kind else None
    return CollisionCourse(gap_m, relative_speed_mps, injection, lowest_m, infeasible, config.dt_s, collision)


def _collision(error: FloatArray, watched: BoolArray, step: int, config: FdiConfig) -> Collision | None:
    """The watched pair that is deepest inside the other at this sample."""
    n = config.num_vehicles
    closed = np.flatnonzero(watched & (error[:n] <= -config.desired_gap_m + TOUCH_M))
    if not len(closed):
        return None
    pair = closed[np.argmin(error[closed])]
    return Collision(int(pair) + 1, step * config.dt_s, float(error[n + pair]))
