"""Configurations and policies that cannot be right are refused with the remedy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from cps_envs import PROBLEMS
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.problem import Problem
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import Role
from cps_envs.rogue.controllers import CONTROLLERS
from cps_paper.testbed.robots.problem import TESTBED
from tests.episodes import spec_of

HYPOTHESES = "cps_baselines.fdi.hypotheses:Hypotheses"
PUSHED = {"command_attack_w": 300.0}
FULL = r"attack_action|keep_noise=true"  # attackers that replace readings need the full action
Overrides = Mapping[str, Any]
CONFIGURATIONS: Mapping[str, Sequence[tuple[Overrides, str]]] = {
    "disbanding": [
        ({"attacked_member": 11}, "attacked_member"),
        ({"tau": 0.3}, "'tau_s'"),
        ({"control_period_s": 0.3}, "control_period_s=0.1"),
        ({"control_period_s": 0.025}, "integration step"),
        ({"interpretation": "S2", "control_period_s": 0.01}, "integration step 0.05"),
        ({"interpretation": "S1", "tau_s": 0.01}, 'interpretation="S2"'),
        ({"duration_s": 10.5}, "duration"),
        ({"attack_budget": 11}, "num_platoons"),
        ({"desired_speed_mps": 40.0}, "max_speed_mps"),
        ({"dt_s": 0.0001}, "Choose 0"),
        ({"dt_s": 0.03}, "integration step 0.03"),
        ({"dt_s": 0.05, "tau_s": 0.02, "control_period_s": 0.1}, "a shorter dt_s"),
        ({"attack": "jolt"}, "none is alarmed by anything: give alarming_braking_mps2"),
        ({"alarming_jerk_mps3": 10.0, "member_delay_s": 0.1}, "give takeover_delay_s"),
        ({"alarming_gap_m": 5.0}, "would take over at once"),
        ({"standstill_rule": True, "desired_gap_m": 1.0}, "larger desired_gap_m"),
        ({"standstill_rule": True, "desired_gap_m": 1.5, "gap_spread": 0.4}, "smaller gap_spread"),
    ],
    "fdi": [
        ({"attacked": ""}, "names no sensors"),
        ({"attacked": "y1"}, "names no sensors"),
        ({"attacked": "x5"}, "vehicle 5 is not one of 1 to 4"),
        ({"attacked": 4}, "must be text"),
        ({"target": 5}, "no vehicle of the platoon"),
        ({"tasks": "x4-4"}, "must read like x4>4"),
        ({"horizon": 4}, "below the first feasible step"),
        ({"discretisation": "euler"}, "unstable without any attack"),
        ({"discretisation": "zohu"}, "smaller dt_s"),
        ({"limits": "clip"}, 'preset "defense"'),
        ({"max_acceleration_mps2": float("nan")}, "must be a number"),
        ({"attackd": "x1"}, "attacked"),
        ({"max_range_injection_m": 0.13}, "below range_resolution_m = 0.5.*Raise max_range_injection_m"),
        ({"range_resolution_m": 50.1}, "range_resolution_m"),
        ({"attacked": "v4", "rate_resolution_mps": 20}, "max_rate_injection_mps = 10.0 is below rate_resolution_mps"),
        ({"tasks": "x4>4 v1>1", "max_rate_injection_mps": 0.2}, "lower rate_resolution_mps"),
        ({"tasks": "feasible", "max_rate_injection_mps": 0.2}, "lower rate_resolution_mps"),
        ({"estimator": "kalman"}, 'limits = "clip"'),
        ({"range_noise_m": 0.1}, "range_noise_m needs estimator"),
        ({"attack_share": 0.5}, "attack_share needs estimator"),
        ({"attacked": "rx2"}, "rear sensor needs estimator"),
        ({"gain_spread": 0.1}, "zohu"),
        ({"attacked": "rx1"}, "not one of 2 to 4"),
        ({"disturbance_hold_s": 0.3}, "multiple of dt_s"),
    ],
    "hvac": [
        ({"compromised_weights": (0.0, 0.0)}, "compromised_weights"),
        ({"compromised_weights": (0.2,) * 6}, "compromised_weights"),
        ({"set_size": 4}, "at most 3"),
        ({"set_size": 2, "sensor_sets": (1, 0, 2)}, "leave one of them out"),
        ({"heat_capacity_j_per_k": (0.52e6, -1.0, 0.35e6, 0.55e6)}, "outside"),
        ({"heat_capacity_j_per_k": (0.0, 1e6, 1e6, 1e6)}, "outside"),
        ({"wall_resistance_k_per_w": (0.42, 0.0, 0.12, 0.15)}, "outside"),
        ({"link_resistance_k_per_w": (0.016, 0.012, -0.017, 0.047)}, "outside"),
        ({"wall_resistance_k_per_w": (0.42, 0.1, 0.12)}, "one per zone"),
        ({"heat_capacity_j_per_k": (1e6,), "wall_resistance_k_per_w": (0.1,)}, "numbered from 1 to 1"),
        ({"link_zones": (1, 2, 3)}, "pairs of zones"),
        ({"link_zones": (1, 2, 1, 3, 2, 4, 2, 1)}, "given once"),
        ({"link_zones": (1, 1, 1, 3, 2, 4, 3, 4)}, "two different zones"),
        ({"link_zones": (1, 2, 1, 3, 2, 4, 3, 5)}, "from 1 to 4"),
        ({"link_resistance_k_per_w": (0.016,)}, "one per link"),
        ({"ground_zones": (5,)}, "from 1 to 4"),
        ({"step_s": 3600.0}, "shorter step_s"),
        ({"num_sensors": 6}, "choose 4 or 8"),
        ({"sensor_low_c": 40.0}, "below sensor_high_c"),
        ({"reference_c": 45.0}, "widen sensor_low_c"),
        ({"initial_c": 5.0}, "widen sensor_low_c"),
        ({"thresholds_c2": (0.4,)}, "for two"),
        ({"thresholds_c2": (0.0, 0.4)}, "outside"),
        ({"sensor_sets": (1, 5, 0, 2)}, "from 1 to 4"),
        ({"sensor_sets": (1, 1, 0, 2)}, "each once"),
        ({"sensor_sets": (1, 0, 0, 2)}, "single 0"),
        ({"sensor_sets": (1, 2, 0, 2, 1)}, "twice"),
        ({"sensor_sets": (1, 2)}, "2 to 256"),
        ({"attack_order": (1, 5)}, "1 to 4"),
        ({"attack_order": (1, 1)}, "once"),
        ({"attack_order": (1,), "num_compromised": 2}, "name more"),
        ({"num_compromised": 5}, "lower it"),
        ({"onset_step": 720}, "raise num_steps"),
        ({"onset_step": (100, 800)}, "raise num_steps"),
        ({"command_attack_w": -1.0}, "outside"),
        ({"reference_attack_c": (1.0, 2.0)}, "zone"),
        ({"denial": ("everything",)}, "readings, commands"),
        ({"window_steps": 3}, "window_steps"),
        ({"window_steps": 720}, "num_steps"),
        ({"window": 100}, "'window_steps'"),
    ],
    "rogue": [
        ({"ratio": 1.2}, "'power_ratio'"),
        ({"dt_s": 0.002}, r"dt_s=0\.001 or"),
        ({"onset_s": 5.0}, r"dt_s=0\.0005 or"),
        ({"attacker_index": (2, 4)}, r"0\.0005"),
        ({"dt_s": 0.0003}, "control_period_s"),
        ({"control_period_s": 0.3}, "attack_hold_s"),
        ({"attack_hold_s": 0.05}, r"\[0\.1, 10\]"),
        ({"duration_s": 10.05}, "whole seconds"),
        ({"growth_interval_s": 0.0015}, "dt_s"),
        ({"attacker_index": 5}, r"dt_s=0\.0005 or"),
        ({"attacker_index": 6}, r"within num_vehicles = 5\..* \(1, 5\) for any vehicle"),
        ({"attacker_index": 2, "attacker_indices": (2, 4)}, "leave one of them out"),
        ({"attacker_indices": (2,)}, "one vehicle is attacker_index"),
        ({"attacker_indices": (4, 2)}, "from the rear"),
        ({"attacker_indices": (2, 6)}, "none beyond vehicle 5"),
        ({"attacker_indices": (1, 2, 3, 4, 5)}, "leave an intact one"),
        ({"separation_m": 4.0}, "contact at the start"),
        ({"inner_share": 0.6}, "middle_share"),
        ({"reference_speed_mps": 55.0}, "50 m/s"),
        ({"num_vehicles": 100}, r"100 vehicles .* below 0\.000832 s\. Choose dt_s=0\.0005 or"),
        ({"num_vehicles": 100, "boundary_layer_mps": 0.005}, r"Choose dt_s=0\.0001 or"),
    ],
    "testbed": [
        ({"control_period_s": 0.025}, "multiple of dt_s"),
        ({"duration_s": 60.03}, "multiple of control_period_s"),
        ({"radio_delay_s": 0.07}, "radio_delay_s = 0.07 has to be 0 or a multiple"),
        ({"radius_m": 0.4}, "choose a larger radius_m"),
        ({"desired_speed_mps": 0.4}, "exceeds max_speed_mps"),
        ({"avoidance": "never"}, "always, until_disbanding"),
    ],
}
POLICIES: Mapping[tuple[str, Role, str], Sequence[tuple[str, Overrides, str]]] = {
    ("disbanding", "attacker", "paper"): [
        ("plan?events=[[11,1]]", {}, "platoon 11"),
        ("plan?events=[[0,1]]", {}, "platoon 0"),
        ("plan?events=[[10,0]]", {}, "start at 1 s"),
        ("plan?events=[[10,1],[10,5]]", {}, "twice"),
        ("plan?events=[[10,1],[9,2],[8,3]]", {}, "attack_budget=3"),
    ],
    ("disbanding", "defender", "paper"): [
        ("heuristic?horizon_s=0.25", {}, "multiple of sample_s"),
        ("heuristic?sample_s=0", {}, "sample_s = 0"),
        ("heuristic?decrement_mps2=0", {}, "above 0"),
        ("mpc?solver=hildret", {}, "hildreth"),
        ("copy", {"defense_action": "platoon"}, 'defense_action="vehicle"'),
    ],
    ("fdi", "attacker", "learning"): [
        ("tracker?swing_s=-1", {}, "swing_s"),
        ("swing?open=2", {}, "open"),
        ("swing?swing_s=-1", {}, "swing_s"),
        *((name, {}, "exact front sensors") for name in ("oracle", "bnb", "lp_greedy")),
    ],
    ("fdi", "attacker", "defense"): [("tracker", {}, "estimator")],
    ("fdi", "defender", "learning"): [
        *((name, {}, "exact sensors") for name in ("kinematic", "redundancy", "model")),
        ("chi2?gate=0", {}, "between 0 and 1"),
        ("cusum?drift=-1", {}, "drift"),
        ("cusum?threshold=0", {}, "threshold"),
        ("bank?threshold=0", {}, "threshold"),
        ("bank?gate=1", {}, "between 0 and 1"),
        *(
            (f"{HYPOTHESES}?{each}", {}, "memory of at most 1")
            for each in ("memory=1.1", "threshold=-1", "caution=-0.5")
        ),
    ],
    ("fdi", "defender", "defense"): [
        *((name, {}, "estimator") for name in (HYPOTHESES, "chi2", "cusum", "bank", "informed")),
        ("kinematic?hold_s=-1", {}, "hold_s"),
        ("model?deviations=0", {}, "deviations"),
    ],
    ("hvac", "attacker", "paper"): [
        ("constant?reading_c=50", {}, "sensor_high_c"),
        ("sine?amplitude_c=20", {}, "sensor_low_c"),
        ("sine?period_s=0", {}, "positive period"),
        ("random?low_c=30&high_c=20", {}, "swap"),
        ("ramp?rate_c_per_h=0", {}, "positive"),
        ("ramp?rate_c_per_h=[0.5]", {}, "pair"),
        ("ramp?rate_c_per_h=[1.0,0.5]", {}, "pair"),
        ("ramp?exponent=-1", {}, "exponent"),
        ("mimic?loss_w=-1", {}, "negative"),
        *(
            (name, {"attack_action": "bias"}, FULL)
            for name in ("constant", "sine", "random", "ramp", "root_ramp", "mimic")
        ),
        ("brink?gain=0", {}, "gain"),
        ("brink?margin_c2=0.5", {}, "margin"),
        ("brink", {"attacker_view": "grey"}, "white"),
        ("brink", {"attack_action": "bias"}, "any"),
        ("brink", {"sensor_sets": [1, 2, 0, 3, 4, 0, 1]}, "2, 3, 4"),
        ("tracker", {}, "kalman_filters=true"),
        ("push", {}, "set command_attack_w=300, or reference_attack_c"),
        ("push?direction=up", PUSHED, "paid, warmer"),
        ("push?share=1.5", PUSHED, "at most 1"),
        ("push?direction=away", {**PUSHED, "attacker_view": "grey"}, "white"),
        ("covert", {}, "set command_attack_w"),
        ("covert?share=0", PUSHED, "above 0"),
        ("jam", {}, "set denial"),
        ("jam?hold_h=0", {"denial": ["commands"]}, "positive time"),
    ],
    ("hvac", "attacker", "learning"): [
        *((f"tracker?{each}", {}, "positive") for each in ("level=0", "gain=-1", "cap_c=0", "noise=-0.1")),
        ("tracker", {"attacker_view": "grey"}, "white"),
        ("tracker", {"attack_action": "bias"}, "any"),
    ],
    ("hvac", "defender", "paper"): [
        ("mtd2?fallback=luck", {}, "least_mean, model"),
        ("mtd2?threshold_c2=0", {}, "positive"),
        ("fixed?sensors=[1,2,3,4]", {}, "sensor_sets"),
        ("fixed?sensors=[9]", {}, "choose one of"),
        *((name, {}, "kalman_filters=true") for name in ("cusum", "largest", "informed")),
    ],
    ("hvac", "defender", "learning"): [
        *(
            (each, {}, "positive")
            for each in ("cusum?kappa=0", "cusum?smooth=-1", "largest?limit=0", "largest?smooth=-1", "monitor?hold_h=0")
        ),
        ("monitor", {"controller": "on_off"}, 'set controller="clip"'),
        ("monitor", {"outdoor_c": Series((5.0, 9.0), 3600.0, repeats=True)}, "leave series out"),
    ],
    ("rogue", "attacker", "paper"): [
        ("square?frequency_hz=0", {}, "frequency_hz > 0"),
        ("square?duty=1.2", {}, "duty <= 1"),
        ("random?braking_s=0.05", {}, "attack_hold_s"),
        ("switching?weights=[1,2]", {}, r"\(7,\)"),
        ("switching?against=slidingg", {}, "Did you mean 'sliding'"),
    ],
    ("rogue", "attacker", "learning"): [
        *((f"strike?{each}", {}, "strike_s") for each in ("strike_s=12&period_s=12", "effort=1.5", "strike_s=0")),
    ],
    ("rogue", "defender", "paper"): [
        ("disband_7", {"max_growth_m": 5.0}, "max_growth_m"),
        ("disband_2", {"defense_action": "command"}, 'defense_action="mode"'),
        ("sliding", {"defense_action": "command"}, 'defense_action="mode"'),
        ("cps_baselines.rogue.controllers:HeldController?controller=lineer", {}, CONTROLLERS[0]),
    ],
}


def cases(table: Mapping[Any, Sequence[Any]]) -> list[Any]:
    return [(key, *case) for key, group in table.items() for case in group]


def problem_of(name: str) -> Problem:
    return TESTBED if name == TESTBED.name else PROBLEMS[name]


@pytest.mark.parametrize(("name", "overrides", "remedy"), cases(CONFIGURATIONS))
def test_configurations_that_cannot_be_right(name: str, overrides: Overrides, remedy: str) -> None:
    with pytest.raises(ConfigurationError, match=remedy):
        problem_of(name).config("paper", overrides)


@pytest.mark.parametrize(("where", "reference", "overrides", "remedy"), cases(POLICIES))
def test_policies_that_cannot_be_right(
    where: tuple[str, Role, str], reference: str, overrides: Overrides, remedy: str
) -> None:
    name, role, preset = where
    spec = spec_of(PROBLEMS[name], role, preset, **overrides)
    with pytest.raises(ConfigurationError, match=remedy):
        resolve_policy(reference, spec)
