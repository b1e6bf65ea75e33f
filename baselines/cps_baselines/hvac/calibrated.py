"""MTD2 with a threshold that was calibrated for what the plant and the model differ by."""

from __future__ import annotations

import json
from dataclasses import fields
from functools import lru_cache
from importlib.resources import files
from typing import Any

from cps_baselines.hvac.moving_target import Mtd2
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policy import RoleSpec
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.problem import HVAC

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
    "attacker_view",
    "kalman_filters",
    "filter_heat_w",
    "filter_memory_h",
)


@lru_cache(maxsize=1)
def shipped_thresholds() -> tuple[tuple[HvacConfig, float], ...]:
    """Configurations with the threshold, C2, that `cps-envs calibrate-mtd2` found for each."""
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
        "no threshold is shipped for this configuration: find one with `cps-envs calibrate-mtd2 --set FIELD=VALUE` and "
        "name the policy mtd2?threshold_c2=VALUE"
    )


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
