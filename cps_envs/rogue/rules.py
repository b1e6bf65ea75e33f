"""What is the same in every episode of a game, as one record that kernels read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cps_envs.rogue.config import RogueConfig

TURN = 6.283185307179586
RULES = np.dtype(
    [
        ("dt_s", np.float64),
        ("steps_per_period", np.int64),  # integration steps in a game step
        ("hold_steps", np.int64),  # integration steps between two decisions of the attacker
        ("horizon_steps", np.int64),  # integration steps in an episode
        ("min_effort", np.float64),  # F-
        ("max_effort", np.float64),  # F+
        ("separation_m", np.float64),  # sigma, between centres
        ("vehicle_length_m", np.float64),  # l
        ("proportional_gain", np.float64),  # k_p, 1/s2
        ("derivative_gain", np.float64),  # k_d, 1/s
        ("surface_slope_per_s", np.float64),  # k_1
        ("boundary_layer_mps", np.float64),  # epsilon
        ("surface_gain_mps2", np.float64),  # 2 k_1 v_max
        ("max_acceleration_mps2", np.float64),  # a_max
        ("alarm_threshold", np.float64),  # l_1, m2/s3
        ("leak_per_s", np.float64),  # 2 pi f_cutoff
        ("outer_share", np.float64),  # n_1
        ("middle_share", np.float64),  # n_2
        ("inner_share", np.float64),  # n_3
        ("growth_step_m", np.float64),
        ("growth_steps", np.int64),  # integration steps between two growths, t_inc
        ("max_growth_m", np.float64),
        ("driver_acceleration_mps2", np.float64),  # a of (2.5)
        ("driver_braking_mps2", np.float64),  # b of (2.5)
        ("driver_headway_s", np.float64),  # h of (2.5)
        ("driver_gap_m", np.float64),  # r_0 of (2.5)
        ("human_returns", np.bool_),
        ("solid", np.bool_),
        ("formation_weight_mps2", np.float64),  # w
        ("range_noise_m", np.float64),
        ("range_rate_noise_mps", np.float64),
        ("acceleration_noise_mps2", np.float64),
    ],
    align=True,
)


def rules_of(config: RogueConfig) -> NDArray[np.void]:
    """The rules of a configuration, an array (1,) of RULES."""
    derived = {
        "hold_steps": round(config.attack_hold_s / config.dt_s),
        "horizon_steps": round(config.duration_s / config.dt_s),
        "surface_gain_mps2": 2 * config.surface_slope_per_s * config.max_speed_mps,
        "leak_per_s": TURN * config.detector_cutoff_hz,
        "growth_steps": round(config.growth_interval_s / config.dt_s),
        "solid": config.contact == "solid",
    }
    rules = np.zeros(1, RULES)
    for name in rules.dtype.fields or ():
        rules[name] = derived[name] if name in derived else getattr(config, name)
    return rules
