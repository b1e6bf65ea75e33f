"""How the threshold eps of MTD2 is found: from the residuals that the sets have while nobody attacks.

`cps-envs calibrate-mtd2 --out thresholds.json` made the file `thresholds.json` beside this module.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from cps_envs.core.game import Game
from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import SensorSet, sensor_sets

MARGIN = 1.2
SETTLING_STEPS = 20  # the mean of fewer residuals scatters too much
SEEDS = tuple(range(1000, 1005))
DEFENDER = "mtd1"  # does not use a threshold
HARD = {"model_error": 0.05, "unmeasured_heat_w": 100.0}
Report = Callable[[int], None]  # steps done


class Level(NamedTuple):
    """A configuration to calibrate for."""

    preset: str
    overrides: Mapping[str, Any]

    @property
    def config(self) -> HvacConfig:
        """The configuration that they name."""
        config: HvacConfig = HVAC.config(self.preset, self.overrides)
        return config


SHIPPED = tuple(
    Level(preset, {"num_sensors": sensors, **mismatch})
    for preset, mismatch in (("paper", {}), ("easy", {}), ("easy", HARD))
    for sensors in (4, 8)
)


@dataclass(frozen=True)
class Calibration:
    """What attack-free episodes say about the threshold under a configuration."""

    config: HvacConfig
    seeds: tuple[int, ...]
    largest_c2: FloatArray  # (episodes, sets) the largest Jm_a of each set from k_0 + 20 on
    rejecting_share: FloatArray  # (episodes,) of the steps from k_0 on: no set passes the configuration's present eps

    @property
    def threshold_c2(self) -> float:
        """Eps: 1.2 times the largest mean residual of any set in any episode, C2."""
        return MARGIN * float(self.largest_c2.max())

    @property
    def largest_set(self) -> SensorSet:
        """The sensors of the set that decided it."""
        return sensor_sets(self.config)[int(self.largest_c2.max(axis=0).argmax())]


def calibrate(config: HvacConfig, seeds: Sequence[int] = SEEDS, *, report: Report | None = None) -> Calibration:
    """Play attack-free episodes under MTD1, one per seed, and keep the largest mean residuals.

    Calibrate anew for each number of sensors, noise, window and mismatch between plant and model: eps is valid for the
    configuration that it was found under.
    """
    largest = np.zeros((len(seeds), 1))

    def note(game: Game) -> None:
        nonlocal largest
        assert isinstance(game, HvacGame)
        done = int(game.elapsed[0])
        if done >= config.window_steps + SETTLING_STEPS:
            largest = np.maximum(largest, game.mean_residuals())
        if report is not None:
            report(done)

    outcome = play_episodes(HVAC, config, {"attacker": "none", "defender": DEFENDER}, seeds, on_step=note)
    share = outcome["rejecting_steps"] / (config.num_steps - 1 - config.window_steps)
    return Calibration(config, tuple(seeds), largest, share)
