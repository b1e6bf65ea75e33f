"""Numbers of a configuration that fit the paper's house and are used for another one."""

from __future__ import annotations

import numpy as np

from cps_envs.core.declare.config import bounds
from cps_envs.core.declare.foreign import other_fields
from cps_envs.hvac.closed_loop import unheated
from cps_envs.hvac.config import HOUSE, PAPER, PRESETS, SYSTEM, HvacConfig
from cps_envs.hvac.parameters import MEAN_CAPACITY_J_PER_K

TESTED = (*SYSTEM, "window_steps", "model_error", "unmeasured_heat_w")  # what thresholds depend on
HEATED = (  # what the closed loop depends on
    *HOUSE,
    *("step_s", "prediction_steps", "move_weight", "reference_c", "initial_c", "max_heating_w", "min_heating_w"),
    *("ground_c", "outdoor_c", "outdoor_mean_c", "outdoor_swing_c", "internal_heat_w"),
)
HEATS = ("heat_drift_w", "unmeasured_heat_w")  # of what the model does not know
FACTOR = 4.0  # between the heat capacities of two houses that differ
PAPERS_SENSORS = (4, 8)


def foreign(config: HvacConfig) -> list[str]:
    """A sentence for each kind of number that is of another house."""
    found = [_dishonest(config), _thresholds(config), _heats(config)]
    if other_fields(config, PRESETS, HEATED):
        found.append(unheated(config))
    return [each for each in found if each]


def _dishonest(config: HvacConfig) -> str:
    """Days on which nobody is honest although nobody has asked for them."""
    sensors, weights, count = config.num_sensors, config.compromised_weights, config.num_compromised
    if config.max_compromised < sensors:
        return ""
    if weights:
        share = weights[sensors] / sum(weights)
        given, remedy = f"compromised_weights = {weights}", f"give {sensors} weights, for 0 to {sensors - 1} sensors"
    elif sensors not in PAPERS_SENSORS:
        least, most = bounds(count)
        share = 1.0 / (most - least + 1)
        given, remedy = f"num_compromised = {count}", f"give {sensors - 1} or fewer" if sensors > 1 else "add a sensor"
    else:
        return ""
    return (
        f"{given} compromise{'s' * (not weights)} all {sensors} sensors in {share:.0%} of the episodes, which no "
        f"defender can tell: {remedy}"
    )


def _thresholds(config: HvacConfig) -> str:
    own = other_fields(config, PRESETS, TESTED)
    if not own or config.thresholds_c2 != PAPER.thresholds_c2:
        return ""
    return (
        f"thresholds_c2 = {config.thresholds_c2} C2 is of the paper's house, and {own[0]} is another here: "
        "cps_baselines.hvac.calibrated.calibrate finds the threshold of yours"
    )


def _heats(config: HvacConfig) -> str:
    """Unknown heat of a preset, which moves a house of another size by far more or less."""
    share = float(np.mean(config.heat_capacity_j_per_k)) / MEAN_CAPACITY_J_PER_K
    if 1.0 / FACTOR <= share <= FACTOR:
        return ""
    for name in HEATS:
        value = getattr(config, name)
        if bounds(value)[1] > 0 and any(value == getattr(preset, name) for preset in PRESETS.values()):
            also = " and filter_heat_w" if config.kalman_filters else ""
            much = "too little" if share > 1.0 else "too much"
            return (
                f"{name} = {value} W is of the paper's house, and {much} for one of {share:.3g} times its heat "
                f"capacity: give about {share:.3g} times {name}{also}"
            )
    return ""
