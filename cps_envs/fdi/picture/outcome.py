"""What a scene says in words: the task, what is certified about it, how the episode ended."""

from __future__ import annotations

import numpy as np

from cps_envs.fdi.legality import SLACK
from cps_envs.fdi.picture.scene import Scene

PROVED_MPS = 1e-3  # a value this near its bound is written as the optimum


def task_of(scene: Scene) -> str:
    """The task in words."""
    n = len(scene.gap)
    ends = np.cumsum([n, n, n - 1])[: 3 if len(scene.attacked) > 2 * n else 1]
    kinds = (("range", 1), ("range-rate", 1), ("rear range", 2), ("rear range-rate", 2))
    groups = zip(kinds, np.split(scene.attacked, ends), strict=False)
    named = [
        f"{kind} of {', '.join(map(str, first + np.flatnonzero(marks)))}"
        for (kind, first), marks in groups
        if marks.any()
    ]
    ahead = "its reference" if scene.target == n else str(scene.target + 1)
    wanted = f"{scene.target} is to hit {ahead}"
    if "error_growth_m" in scene.metrics:
        wanted = f"the errors of {scene.target} are to grow"
    return f"{n} vehicles, falsified {' and '.join(named)}; {wanted}"


def certificate_of(scene: Scene) -> str:
    """What is known about the highest impact speed, and whether it holds in this episode."""
    bound, value = scene.metrics["oracle_bound_mps"], scene.metrics["oracle_value_mps"]
    if not is_certified(scene):
        return f"{value:.2f} known to be possible" if value > 0 else "nothing certified for this task"
    if not scene.metrics["bound_valid"]:
        return f"certified {bound:.2f} does not apply here"
    if bound == 0:
        return "certified to be unreachable"
    proved = bound - value < PROVED_MPS
    return f"certified optimum {bound:.2f}" if proved else f"certified {value:.2f} to {bound:.2f}"


def is_certified(scene: Scene) -> bool:
    """Whether a bound is known for the task, be it of other episodes than this one."""
    bound = scene.metrics["oracle_bound_mps"]
    return bool(np.isfinite(bound) and (bound > 0 or scene.metrics["bound_valid"]))


def outcome_of(scene: Scene) -> str:
    """Who collided, what was illegal, or that time is up; empty while the episode goes on."""
    if scene.metrics["collided_pairs"]:
        pairs = np.flatnonzero(scene.gap <= SLACK)
        fastest = pairs[np.argsort(-scene.closing_speed[pairs], kind="stable")].tolist()
        more = f", and {len(fastest) - 2} more pairs" if len(fastest) > 2 else ""
        return "Collision: " + ", ".join(collision_of(scene, pair) for pair in fastest[:2]) + more
    if scene.metrics["illegal"]:
        return f"Illegal: {reason_of(scene)}"
    return "No collision in time" if scene.time_s > scene.duration_s - scene.config.dt_s / 2 else ""


def collision_of(scene: Scene, pair: int) -> str:
    """A pair, counted from 0, and its closing speed."""
    ahead = "reference" if pair + 1 == len(scene.gap) else str(pair + 2)
    return f"{pair + 1} hits {ahead} at {scene.closing_speed[pair]:.2f} m/s"


def reason_of(scene: Scene) -> str:
    """Which limit, (3.49) or (3.50), the last injection exceeded."""
    config = scene.config
    low, high = config.min_acceleration_mps2 - SLACK, config.max_acceleration_mps2 + SLACK
    excess = np.maximum(low - scene.command, scene.command - high)
    worst = int(excess.argmax())
    if config.limit_commands and excess[worst] > 0:
        return f"vehicle {worst + 1} would have to command {scene.command[worst]:.1f} m/s²"
    below = np.flatnonzero(scene.reported_gap < -SLACK)
    return "range below 0 m reported by " + ", ".join(str(i + 1) for i in below)
