"""Drawing the episodes of an episode: the vehicles, who is seized, when the attack begins, and the perturbed start."""

from __future__ import annotations

import numpy as np

from cps_envs.core.config import bounds
from cps_envs.rogue.config import RogueConfig
from cps_envs.rogue.state import State


def start(state: State, b: int, config: RogueConfig, generator: np.random.Generator) -> None:
    """Put an episode at time 0 in steady state, perturbed as the configuration says, with everything counted at zero.

    What the configuration leaves exact is drawn too, so that the order of draws is always the same.
    """
    for array in state:
        array[b] = 0
    log, episode, vehicles = state.log[b], state.episode[b], state.vehicles[b]
    state.pairs["armed"][b] = True
    log["first_collision_s"] = log["first_alarm_s"] = -1.0
    first, last = bounds(config.attacker_index)
    episode["attacker"] = generator.integers(int(first), int(last) + 1) - 1
    episode["drive_mps2"] = generator.uniform(*bounds(config.drive_mps2))
    episode["attacker_drive_mps2"] = generator.uniform(*bounds(config.power_ratio)) * episode["drive_mps2"]
    episode["drag_per_s"] = generator.uniform(*bounds(config.drag_per_s))
    episode["reference_speed_mps"] = generator.uniform(*bounds(config.reference_speed_mps))
    episode["onset_step"] = round(generator.uniform(*bounds(config.onset_s)) / config.dt_s)
    episode["noise_seed"] = generator.integers(0, 2**64, dtype=np.uint64)
    count = config.num_vehicles
    spacings = config.separation_m + generator.uniform(-config.spacing_spread_m, config.spacing_spread_m, count)
    speeds = generator.uniform(-config.speed_spread_mps, config.speed_spread_mps, count)
    vehicles["position"] = np.cumsum(spacings) - spacings[0]
    vehicles["speed"] = episode["reference_speed_mps"] + speeds
    episode["reference_start_m"] = vehicles["position"][-1]
