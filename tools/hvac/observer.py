"""`python -m tools.hvac.observer` measures how far estimates lie from those of the pseudo-inverse of their window.

Rows are preset `paper`, then drawn buildings of four zones. Sensors are attacked at random, and sets used at random.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from cps_envs.core.declare.foreign import ForeignSettingWarning
from cps_envs.core.types import Array, Role
from cps_envs.hvac.building import discretise
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.moving_horizon import MAX_CONDITION, ObservabilityWarning, observability, powers, set_gains
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import membership, zones_of_sensors

WINDOWS = (60, 100, 150, 200)
STEPS = 130  # beyond a full window
PARTS = {  # powers of 10 between which a value is drawn for each zone or link
    "heat_capacity_j_per_k": (5.3, 6.8),
    "wall_resistance_k_per_w": (-1.5, -0.3),
    "link_resistance_k_per_w": (-2.3, -0.7),
}


def drawn(generator: np.random.Generator) -> dict[str, Any]:
    """A window and a building."""
    parts = {name: tuple(10.0 ** generator.uniform(*ends, 4)) for name, ends in PARTS.items()}
    return {"window_steps": int(generator.choice(WINDOWS)), **parts}


def distance_c(overrides: Mapping[str, Any]) -> tuple[float, float]:
    """The largest difference of any zone, set and step, C, and the largest cond(O_a) of a set that the sums serve."""
    window = int(overrides.get("window_steps", 200))
    config = HVAC.config("paper", {**overrides, "num_steps": window + STEPS, "onset_step": window // 2})
    game, generator = HvacGame(config, 1), np.random.default_rng(0)
    game.reset(np.ones(1, np.bool_), [np.random.default_rng(0)])
    steps, member, zone = powers(discretise(config).A, window), membership(config), zones_of_sensors(config)
    condition = set_gains(steps[1], window, member, zone)[1]
    inverses = [steps[window] @ np.linalg.pinv(observability(steps[:window], sensors, zone)) for sensors in member]
    worst = 0.0
    for k in range(1, config.num_steps - 1):
        forged = np.append(generator.uniform(-1, 1, config.num_sensors), 0.0)
        actions: dict[Role, Array] = {"defender": generator.integers(0, len(member), 1), "attacker": forged[np.newaxis]}
        game.advance(actions, np.ones(1, np.bool_), 1)
        if k >= window:
            readings = game.state.series[0, k - window : k]
            for a, (sensors, inverse) in enumerate(zip(member, inverses, strict=True)):
                found = game.state.forced[0] + inverse @ readings[:, sensors].ravel()
                worst = max(worst, float(np.abs(game.state.estimate[0, 1 + a] - found).max()))
    return worst, float(condition[condition <= MAX_CONDITION].max(initial=0.0))


def main() -> None:
    """Print a row for each building."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", type=int, default=20, help="draw so many")
    generator = np.random.default_rng(0)
    for known in (ObservabilityWarning, ForeignSettingWarning):
        warnings.simplefilter("ignore", known)
    for number in range(parser.parse_args().buildings + 1):
        overrides = drawn(generator) if number else {}
        worst, condition = distance_c(overrides)
        name = f"building {number}, N_e = {overrides['window_steps']}" if number else "paper"
        print(f"{name}: {worst:.1e} C, condition {condition:.1e}", flush=True)


if __name__ == "__main__":
    main()
