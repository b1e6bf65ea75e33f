"""Drawing the episodes of an episode: parameters, perturbed start, drivers and the attacker's budget."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cps_envs.core.config import IntRange, bounds
from cps_envs.core.types import Array
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.constants import Constants
from cps_envs.disbanding.parameters import PARAMETERS

MIN_SPEED_MPS = 0.0  # Table 2.1: v_min


class Episode(NamedTuple):
    """What a reset draws for one episode."""

    parameters: Array  # () a record of PARAMETERS
    budget: int  # platoons that the attacker may disband
    gap_factors: NDArray[np.float64]  # (M,)
    speed_offsets_mps: NDArray[np.float64]  # (M,)
    takeover_delays_s: NDArray[np.float64]  # (M,)
    driver_headways_s: NDArray[np.float64]  # (M,)


def draw_episode(config: DisbandingConfig, generator: np.random.Generator) -> Episode:
    """One episode; what the configuration leaves exact is drawn too, so that the order of draws is always the same."""
    vehicles = config.max_vehicles
    return Episode(
        parameters=draw_parameters(config, generator),
        budget=_draw_whole(config.attack_budget, generator),
        gap_factors=1.0 + generator.uniform(-config.gap_spread, config.gap_spread, vehicles),
        speed_offsets_mps=generator.uniform(-config.speed_spread_mps, config.speed_spread_mps, vehicles),
        takeover_delays_s=generator.uniform(*bounds(config.takeover_delay_s), vehicles),
        driver_headways_s=generator.uniform(*bounds(config.driver_headway_s), vehicles),
    )


def draw_parameters(config: DisbandingConfig, generator: np.random.Generator) -> Array:
    """The episode's record of PARAMETERS."""
    record = np.zeros((), PARAMETERS)
    drawn = {
        "num_vehicles": _draw_whole(config.num_platoons, generator) * config.vehicles_per_platoon,
        "tau_s": generator.uniform(*bounds(config.tau_s)),
        "desired_gap_m": generator.uniform(*bounds(config.desired_gap_m)),
    }
    for name, value in (_exact(config) | drawn).items():
        record[name] = value
    return record


def _exact(config: DisbandingConfig) -> dict[str, Any]:
    """The fields of PARAMETERS as the configuration has them; a drawn one may still be a range."""
    known = vars(config) | vars(config.dynamics) | {"num_vehicles": config.max_vehicles, "min_speed_mps": MIN_SPEED_MPS}
    known["stop_at_collision"] = config.on_collision == "end"
    return {name: known[name] for name in Constants._fields}


def nominal_constants(config: DisbandingConfig) -> Constants:
    """What is publicly known of every episode, for policies; drawn quantities stand at the middle of their range."""
    middle = {name: sum(bounds(getattr(config, name))) / 2 for name in ("tau_s", "desired_gap_m")}
    return Constants(**(_exact(config) | middle))


def _draw_whole(value: IntRange, generator: np.random.Generator) -> int:
    low, high = bounds(value)
    return int(generator.integers(int(low), int(high) + 1))
