"""MTD2 with a threshold that was calibrated for what the plant and the model differ by, and how eps is found.

It is found from the residuals that the sets have while nobody attacks. `thresholds.json` beside this module holds some.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from cps_baselines.hvac.moving_target import Mtd2
from cps_envs.core.declare.foreign import ForeignSettingWarning
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.game import Game
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.policy import RoleSpec, plays_in
from cps_envs.core.types import FloatArray
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC

MARGIN = 1.2
SETTLING_STEPS = 20  # the mean of fewer residuals scatters too much
SEEDS = tuple(range(1000, 1005))
DEFENDER = "mtd1"  # does not use a threshold
HARD = {"model_error": 0.05, "unmeasured_heat_w": 100.0}  # the hard level of preset `easy`


@dataclass(frozen=True)
class Calibration:
    """What attack-free episodes say about the threshold under a configuration."""

    largest_c2: FloatArray  # (episodes, sets) the largest Jm_a of each set from k_0 + 20 on

    @property
    def threshold_c2(self) -> float:
        """Eps: 1.2 times the largest mean residual of any set in any episode, C2."""
        return MARGIN * float(self.largest_c2.max())


def calibrate(config: HvacConfig, seeds: Sequence[int] = SEEDS) -> Calibration:
    """Play attack-free episodes under MTD1, one per seed, and keep the largest mean residuals.

    Calibrate again for each number of sensors, noise, window and mismatch between plant and model: eps is valid for the
    configuration that it was found under.
    """
    largest = np.zeros((len(seeds), 1))

    def note(game: Game) -> None:
        nonlocal largest
        assert isinstance(game, HvacGame)
        if game.elapsed[0] >= config.window_steps + SETTLING_STEPS:
            largest = np.maximum(largest, game.mean_residuals())

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ForeignSettingWarning)  # of the thresholds that are to be found
        play_episodes(HVAC, config, {"attacker": "none", "defender": DEFENDER}, seeds, on_step=note)
    return Calibration(largest)


# What a threshold does not depend on: the attack, the threshold itself, and the length of the day.
IRRELEVANT = (
    "thresholds_c2",
    "num_steps",
    "onset_step",
    "num_compromised",
    "compromised_weights",
    "attack_order",
    "random_compromise",
    "attack_action",
    "command_attack_w",
    "reference_attack_c",
    "denial",
    "thermostats",
    "attacker_view",
    "kalman_filters",
    "filter_heat_w",
    "filter_memory_h",
)


@lru_cache(maxsize=1)
def shipped_thresholds() -> tuple[tuple[HvacConfig, float], ...]:
    """The configurations of `thresholds.json` with the threshold, C2, that `calibrate` found for each."""
    text = files("cps_baselines.hvac").joinpath("thresholds.json").read_text(encoding="utf-8")
    levels = json.loads(text)["levels"]
    return tuple((HVAC.config(level["preset"], level["overrides"]), level["threshold_c2"]) for level in levels)


def calibrated_threshold(config: HvacConfig) -> float:
    """The shipped threshold, C2, of a configuration; attack and length of the day do not matter.

    Raises:
        ConfigurationError: none is shipped for such a building, such sensors, such noise or such a mismatch.
    """
    for known, threshold_c2 in shipped_thresholds():
        if _relevant(known) == _relevant(config):
            return threshold_c2
    raise ConfigurationError(
        "no threshold is shipped for this configuration, as it is for preset paper: find one with "
        "calibrate(config).threshold_c2 of cps_baselines.hvac.calibrated, and name the policy mtd2?threshold_c2=VALUE"
    )


@plays_in("paper")
def mtd2_calibrated(spec: RoleSpec, *, fallback: str = "least_mean") -> Mtd2:
    """Plays MTD2 with eps calibrated for the configuration's own mismatch between plant and model.

    The paper's eps belongs to an exact model. Shipped are the presets `paper` and `easy` and the hard level of
    `easy` (5 %, 100 W), with one and with two sensors per zone.

    Raises:
        ConfigurationError: no threshold is shipped for the configuration, or another fallback.
    """
    return Mtd2(spec, fallback=fallback, threshold_c2=calibrated_threshold(spec.config))


def _relevant(config: HvacConfig) -> dict[str, Any]:
    names = (field.name for field in fields(config) if field.name not in IRRELEVANT)
    return {name: getattr(config, name) for name in names}
