"""What no defence can avoid once the front platoon is disbanded, as a function of the gap that vehicles keep.

Drivers look ahead only, so the last disbanded vehicle moves as it does without a defence. A vehicle that never comes
nearer to it than the sum of the gaps between them falls behind its place at the desired speed by at least what that
vehicle loses, less the room that shrinking the gaps gives. The sum of |v - v_d| is at least that distance (2.8).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.problem import DISBANDING


def least_errors(
    config: Any, gap_m: FloatArray | float, seeds: Sequence[int] = (0,), time_s: float = 1.0
) -> dict[str, FloatArray]:
    """Lower bounds of `velocity_error_intact` and `velocity_error_all`, (B,) percent, for the episodes of `seeds`.

    The front platoon alone is disbanded, at `time_s` or as soon as that is legal; in an episode without an attack the
    bounds are 0. No gap ahead of an intact vehicle falls below `gap_m`, one number or (B,). The bounds hold for every
    defence, one that knows the future included: they are certified up to the sampling of a control period.
    """
    places: list[FloatArray] = []
    finals: dict[str, Any] = {}
    size = config.vehicles_per_platoon

    def note(game: Any) -> None:
        if not places:
            finals["start"], finals["state"] = game.state.position.copy(), game.state
            finals["vehicles"] = game.constants["num_vehicles"].copy()
        places.append(game.state.position[:, size - 1].copy())

    lead = f"lead?time_s={time_s}"
    outcome = play_episodes(DISBANDING, config, {"attacker": lead, "defender": "none"}, seeds, on_step=note)
    start, vehicles = finals["start"], finals["vehicles"]
    times_s = np.linspace(0.0, config.duration_s, len(places))
    lost = config.desired_speed_mps * times_s[:, np.newaxis] - (np.array(places) - start[:, size - 1])
    behind = np.arange(start.shape[1]) - (size - 1)
    room = start[:, size - 1 : size] - start - np.reshape(gap_m, (-1, 1)) * behind
    least = np.maximum(0.0, lost.max(axis=0)[:, np.newaxis] - np.maximum(room, 0.0))
    intact = (behind > 0) & (np.arange(start.shape[1]) < vehicles[:, np.newaxis])
    attacked = outcome["disbanded_platoons"] > 0
    bound = np.where(attacked, (least * intact).sum(axis=1), 0.0)
    drivers = config.dynamics.dt_s * finals["state"].speed_error[:, :size].sum(axis=1)
    percent = 100.0 / (config.duration_s * config.desired_speed_mps)
    return {
        "velocity_error_intact": percent * bound / (vehicles - size),
        "velocity_error_all": percent * (bound + np.where(attacked, drivers, 0.0)) / vehicles,
    }
