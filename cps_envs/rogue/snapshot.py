"""Reading the scene of an episode off the state."""

from __future__ import annotations

import numpy as np

from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.laws import COMMANDED, DRIVEN
from cps_envs.rogue.scene import Scene
from cps_envs.rogue.state import State


def scene_of(state: State, b: int, config: RogueConfig, metrics: dict[str, float]) -> Scene:
    """Copies of what a picture shows of an episode."""
    episode, log = state.episode[b], state.log[b]
    vehicles, pairs = state.vehicles[b].copy(), state.pairs[b].copy()
    position = vehicles["position"]
    seized = int(episode["attacker"])
    names = ["commanded" if law == COMMANDED else DRIVEN[law] for law in vehicles["law"].tolist()]
    names[seized] = "attacker"
    return Scene(
        episode=int(episode["noise_seed"]),
        time_s=float(log["step"] * config.dt_s),
        duration_s=config.duration_s,
        attacker=seized,
        onset_s=float(episode["onset_step"] * config.dt_s),
        effort=float(log["effort"]),
        effort_limits=(config.min_effort, config.max_effort),
        power_ratio=float(episode["attacker_drive_mps2"] / episode["drive_mps2"]),
        position=position,
        speed=vehicles["speed"],
        acceleration=vehicles["acceleration"],
        reference_m=float(position[-1]) + metrics["reference_error_m"],
        reference_speed_mps=float(episode["reference_speed_mps"]),
        separation_m=config.separation_m,
        vehicle_length_m=config.vehicle_length_m,
        growth=vehicles["growth"],
        law=tuple(names),
        alarm=vehicles["alarm"],
        detector=np.stack([vehicles["front_detector"], vehicles["rear_detector"]], axis=1),
        alarm_threshold=config.alarm_threshold,
        contact=config.contact,
        touching=~pairs["armed"],
        damage=pairs["damage"],
        metrics=metrics,
    )
