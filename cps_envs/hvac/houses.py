"""Buildings of any size: storeys of rooms side by side, with walls between them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.parameters import MAX_ZONES

# From what the paper's four zones have (calibrated), drawn uniformly.
CAPACITY_J_PER_K = (0.35e6, 0.74e6)
WALL_K_PER_W = (0.10, 0.42)
LINK_K_PER_W = (0.012, 0.047)
PREDICTED = 1280  # zones times steps of the controller's prediction, whose matrices are the square of this


def house(num_zones: int, *, columns: int | None = None, sensors_per_zone: int = 1, seed: int = 0) -> dict[str, Any]:
    """A building of `num_zones` rooms as fields of the configuration: `gymnasium.make(id, **house(64))`.

    Zones are numbered storey by storey from the top, `columns` to a storey; without it there are as many storeys as
    columns. Neighbours beside, above and below are linked, and the lowest storey stands on the ground. Capacities and
    resistances are drawn within what the paper's zones have, so that no two zones are alike: else sensors could not
    tell them apart. Sets leave a quarter of the sensors out (`set_size`), so that their number is that of the sensors.

    The threshold of MTD2 is not part of it: `cps_baselines.hvac.calibrated.calibrate` finds `thresholds_c2`.

    Raises:
        ConfigurationError: fewer than 1 or more than 64 zones, fewer than one column, or not one or two sensors each.
    """
    columns = math.ceil(math.sqrt(num_zones)) if columns is None else columns
    if not (1 <= num_zones <= MAX_ZONES and columns >= 1 and sensors_per_zone in (1, 2)):
        raise ConfigurationError(
            f"num_zones = {num_zones}, columns = {columns}, sensors_per_zone = {sensors_per_zone}: a house has 1 to "
            f"{MAX_ZONES} zones, at least one column, and one or two sensors in each zone."
        )
    generator, rooms = np.random.default_rng(seed), _rooms(num_zones, columns)
    links = _links(rooms)
    sensors = num_zones * sensors_per_zone
    return {
        "heat_capacity_j_per_k": _drawn(generator, CAPACITY_J_PER_K, num_zones),
        "wall_resistance_k_per_w": _drawn(generator, WALL_K_PER_W, num_zones),
        "link_zones": tuple(zone for pair in links for zone in pair),
        "link_resistance_k_per_w": _drawn(generator, LINK_K_PER_W, len(links)),
        "ground_zones": tuple(zone for zone, (storey, _) in enumerate(rooms, 1) if storey == rooms[-1][0]),
        "num_sensors": sensors,
        "set_size": 3 * sensors // 4,
        "num_compromised": min(2, sensors),
        "prediction_steps": min(80, PREDICTED // num_zones),
    }


def _rooms(num_zones: int, columns: int) -> list[tuple[int, int]]:
    """Storey, from the top, and place of each zone; the top storey has what is left over."""
    missing = -num_zones % columns
    places = [(0, place) for place in range(columns - missing)]
    return places + [divmod(place + missing, columns) for place in range(columns - missing, num_zones)]


def _links(rooms: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Pairs of neighbours: each zone with the next of its storey and with the one below."""
    number = {room: zone for zone, room in enumerate(rooms, 1)}
    beside = [(number[storey, place], number.get((storey, place + 1))) for storey, place in rooms]
    below = [(number[storey, place], number.get((storey + 1, place))) for storey, place in rooms]
    return [(zone, other) for zone, other in beside + below if other is not None]


def _drawn(generator: np.random.Generator, ends: tuple[float, float], count: int) -> tuple[float, ...]:
    return tuple(float(f"{value:.4g}") for value in generator.uniform(*ends, count))
