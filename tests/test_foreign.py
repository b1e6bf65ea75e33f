"""Numbers that were found for one system and are used for another: derived, or told in one sentence."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_agents.cli import show_warning
from cps_envs import ForeignSettingWarning
from cps_envs.core.declare.foreign import other_fields
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.disbanding.fields import attacker_fields
from cps_envs.disbanding.foreign import spectral_radius
from cps_envs.hvac.closed_loop import undisturbed
from cps_envs.hvac.parameters import fitting_weight
from cps_envs.hvac.sensors import sensor_sets
from cps_envs.registration import PROBLEMS, find_problem
from cps_envs.rogue.stability import linear_radius

KWH = 3.6e6  # J
HOUSE = {  # identified from measurements, cut into two zones
    "heat_capacity_j_per_k": (6.5 * KWH, 4.0 * KWH),
    "wall_resistance_k_per_w": (5e-3, 6.4e-3),
    "link_zones": (1, 2),
    "link_resistance_k_per_w": (2e-3,),
    "ground_zones": (),
    "num_sensors": 2,
    "num_compromised": 1,
    "outdoor_mean_c": 2.0,
    "outdoor_swing_c": 5.0,
    "reference_c": 21.0,
    "initial_c": 20.0,
    "max_heating_w": 6000.0,
}
ROOM = {  # all of it as one zone
    **HOUSE,
    "heat_capacity_j_per_k": (10.5 * KWH,),
    "wall_resistance_k_per_w": (2.8e-3,),
    "link_zones": (),
    "link_resistance_k_per_w": (),
    "num_sensors": 1,
    "max_heating_w": 12_000.0,
}
THRESHOLD = {"thresholds_c2": (0.3, 0.3)}


def said(problem: str, preset: str, **changes: Any) -> list[str]:
    found = find_problem(problem)
    return found.foreign_to(found.config(preset, changes))


@pytest.mark.parametrize("problem", PROBLEMS)
def test_nothing_is_foreign_to_the_presets_that_ship(problem: str) -> None:
    assert [said(problem, preset) for preset in find_problem(problem).presets] == [[]] * len(
        find_problem(problem).presets
    )


def test_the_paper_keeps_the_weight_that_was_calibrated_for_it_and_a_real_house_gets_its_own() -> None:
    hvac = find_problem("hvac")
    paper = hvac.config("paper", {})
    assert paper.move_weight == 0.25
    assert fitting_weight(paper.heat_capacity_j_per_k) == 0.25
    assert hvac.config("paper", {"heat_capacity_j_per_k": paper.heat_capacity_j_per_k}) == paper
    assert hvac.config("paper", HOUSE).move_weight == pytest.approx(0.25 * (0.54 / 18.9) ** 2, rel=0.01)
    assert hvac.config("paper", {**HOUSE, "move_weight": 0.25}).move_weight == 0.25
    assert fitting_weight((1e12,)) == 1e-9  # what the field takes at least
    with pytest.raises(ConfigurationError, match="heat_capacity_j_per_k"):
        hvac.config("paper", {"heat_capacity_j_per_k": "big"})


@pytest.mark.parametrize("house", [HOUSE, ROOM], ids=["two zones", "one zone"])
def test_a_real_house_is_heated(house: dict[str, Any]) -> None:
    hvac = find_problem("hvac")
    played = play_episodes(hvac, hvac.config("paper", house), {}, [0])
    assert played["discomfort_h"][0] < 0.5  # with the weight of the paper's house nearly all the day
    assert undisturbed(hvac.config("paper", house)).error_c.max() < 0.2
    cold = undisturbed(hvac.config("paper", {**house, "move_weight": 0.25})).error_c
    assert (cold > 8).all()


def test_a_house_that_is_not_heated_is_told_of_with_what_to_change() -> None:
    house = {**HOUSE, **THRESHOLD}
    assert said("hvac", "paper", **house) == []
    assert said("hvac", "paper", **house, move_weight=0.25) == [
        "zone 2 stays 8.88 C off its set-point for half a day without any attack: move_weight = 0.25 C2/W2 makes the "
        "controller too slow for it, and 0.000204 fits"
    ]
    (weak,) = said("hvac", "paper", **{**house, "max_heating_w": 2000.0})
    assert "zone 1 stays 3.96 C off" in weak
    assert "raise max_heating_w = 2000.0" in weak
    (both,) = said("hvac", "paper", **{**house, "max_heating_w": 2000.0, "move_weight": 0.25})
    assert "0.000204 fits; and raise max_heating_w" in both
    (hot,) = said("hvac", "paper", **{**house, "outdoor_mean_c": 30.0})
    assert "lower min_heating_w = 0.0" in hot
    assert said("hvac", "paper", **{**house, "outdoor_mean_c": 30.0, "min_heating_w": -6000.0}) == []
    short = {"num_steps": 100, "window_steps": 50, "onset_step": 60}
    assert said("hvac", "paper", **house, **short, move_weight=0.25) == []  # too short to judge


def test_of_a_series_some_days_are_looked_at() -> None:
    hours = np.arange(24 * 20)
    outside = np.where(hours < 24 * 10, 10.0, -30.0)
    (sentence,) = said(
        "hvac",
        "paper",
        **{**HOUSE, **THRESHOLD},
        outdoor_c=Series(outside, 3600.0),
        series_split="all",
    )
    assert "on 4 of the 8 days that were looked at: raise max_heating_w" in sentence


def test_thresholds_belong_to_a_house_its_noise_and_its_errors() -> None:
    for changes in ({"noise_std_c": 1.0}, {"window_steps": 100}, {"model_error": 0.1}, {"unmeasured_heat_w": 400.0}):
        (name,) = changes
        (sentence,) = said("hvac", "learning", **changes)
        assert sentence.startswith(f"thresholds_c2 = (0.418, 0.425) C2 is of the paper's house, and {name} is another")
        assert said("hvac", "learning", **changes, **THRESHOLD) == []


def test_days_without_an_honest_sensor_that_nobody_asked_for_are_told_of() -> None:
    three = {
        "heat_capacity_j_per_k": (0.5e6, 0.8e6, 0.6e6),
        "wall_resistance_k_per_w": (0.2, 0.1, 0.15),
        "link_zones": (1, 2, 2, 3),
        "link_resistance_k_per_w": (0.02, 0.03),
        "ground_zones": (),
        "num_sensors": 3,
        **THRESHOLD,
    }
    (sentence,) = said("hvac", "learning", **three)
    assert "compromise all 3 sensors in 20% of the episodes" in sentence
    assert said("hvac", "learning", **three, compromised_weights=(0.2, 0.4, 0.4)) == []
    (sentence,) = said("hvac", "easy", **three)
    assert "num_compromised = (1, 3) compromises all 3 sensors in 33% of the episodes" in sentence
    assert "give 2 or fewer" in sentence
    assert said("hvac", "paper", num_compromised=4) == []  # as in the paper


def test_unknown_heat_belongs_to_a_house() -> None:
    (sentence,) = said("hvac", "learning", **HOUSE, **THRESHOLD)
    assert sentence.startswith("heat_drift_w = (50.0, 150.0) W is of the paper's house, and too little for one of 35 ")
    assert sentence.endswith("give about 35 times heat_drift_w and filter_heat_w")
    assert said("hvac", "learning", **HOUSE, **THRESHOLD, heat_drift_w=(2000.0, 5000.0), unmeasured_heat_w=0.0) == []


def test_a_building_of_one_zone_has_a_set_for_each_sensor() -> None:
    hvac = find_problem("hvac")
    assert sensor_sets(hvac.config("paper", ROOM)) == ((1,),)
    assert sensor_sets(hvac.config("paper", {**ROOM, "num_sensors": 2})) == ((1,), (2,))
    (alone,) = said("hvac", "paper", **ROOM, **THRESHOLD)
    assert alone.startswith("num_compromised = 1 compromises all 1 sensors")
    with pytest.raises(ConfigurationError, match=r'num_sensors=2, or say interface="native"'):
        gymnasium.make("cps_envs:cps_envs/HvacDefense-v0", **ROOM)
    config = hvac.config("learning", {**ROOM, **THRESHOLD})
    with np.errstate(divide="raise", invalid="raise"):
        played = play_episodes(hvac, config, {"attacker": "none", "defender": "bayes"}, [0])
    assert played["discomfort_h"][0] < 1.0


@pytest.mark.parametrize(
    ("changes", "sentences"),
    [
        ({"drive_mps2": 4.5}, []),
        (
            {"drive_mps2": 2.5, "max_effort": 1.5},
            [
                "max_acceleration_mps2 = 5 m/s2 and max_speed_mps = 50 m/s, by which the sliding mode reckons, are of "
                "other engines than here: give max_acceleration_mps2=3.75, max_speed_mps=39.47"
            ],
        ),
        (
            {"drive_mps2": 1.0, "reference_speed_mps": 9.0, "max_acceleration_mps2": 1.0, "max_speed_mps": 10.0},
            [
                "alarm_threshold = 200 m2/s3 is more than any attack can reach with these engines and this "
                "detector_cutoff_hz, 108: give about 14"
            ],
        ),
        (
            {"derivative_gain": 0.0},
            [
                "proportional_gain = 1.0 and derivative_gain = 0.0 let the linear controller sway without any attack, "
                "with dt_s = 0.002: change them"
            ],
        ),
        (
            {"duration_s": 24.0},
            [
                "onset_s = (0.0, 30.0) s lets 20% of the attacks begin after the end of the episode at 24 s: lower it, "
                "or raise duration_s"
            ],
        ),
    ],
)
def test_limits_gains_and_thresholds_of_other_vehicles(changes: dict[str, Any], sentences: Sequence[str]) -> None:
    assert said("rogue", "learning", **changes) == sentences


def test_the_linear_controller_is_judged_as_it_is_integrated() -> None:
    n, k_p, k_d, dt_s = 7, 2.0, 0.3, 0.01
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[0, 0] = 1
    speeds = np.hstack([-dt_s * k_p * K, np.eye(n) - dt_s * k_d * K])
    whole = np.vstack([np.hstack([np.eye(n), np.zeros((n, n))]) + dt_s * speeds, speeds])
    assert linear_radius(n, k_p, k_d, dt_s) == pytest.approx(np.abs(np.linalg.eigvals(whole)).max(), abs=1e-9)


def test_a_platoon_with_other_lags_and_gains() -> None:
    assert said("disbanding", "learning", tau_s=2.0) == []
    assert said("disbanding", "paper", tau_s=0.5, derivative_gain=0.5) == [
        "proportional_gain = 1.0 and derivative_gain = 0.5 let an intact platoon sway without any attack, with tau_s = "
        "0.5 and steps of 0.01 s: change them"
    ]
    assert "88% of the attacks begin after the end" in said("disbanding", "learning", duration_s=8)[0]
    config = find_problem("disbanding").config("paper", {"vehicles_per_platoon": 2, "interpretation": "S0"})
    k_p, k_d, h, tau, dt = 1.0, 0.2, config.headway_s, 0.5, 0.01
    own = np.array([[-1.0, 0.0], [1.0, -1.0]])
    feedback = np.hstack([k_p * own, k_d * own - np.diag([k_p * h, 0.0]), np.zeros((2, 2))])
    zero, unit = np.zeros((2, 2)), np.eye(2)
    rows = [np.hstack([zero, unit, zero]), np.hstack([zero, zero, unit])]
    rows.append((feedback - np.hstack([zero, zero, unit])) / tau)
    radius = np.abs(np.linalg.eigvals(np.eye(6) + dt * np.vstack(rows))).max()
    assert spectral_radius(config, tau, k_p, k_d) == pytest.approx(radius, abs=1e-9)


def test_what_is_observed_of_a_platoon_reaches_as_far_as_what_may_be_configured() -> None:
    disbanding = find_problem("disbanding")
    bounds = {
        preset: {f.name: f.high for f in attacker_fields(disbanding.config(preset, {}))} for preset in ("paper", "easy")
    }
    assert all((each["tau_s"], each["desired_gap_m"]) == (1.0, 20.0) for each in bounds.values())
    slow = {f.name: f.high for f in attacker_fields(disbanding.config("paper", {"tau_s": 2.0, "desired_gap_m": 50.0}))}
    assert (slow["tau_s"], slow["desired_gap_m"]) == (2.0, 50.0)


def test_gains_of_sensors_that_lie_are_drawn_within_what_is_stable() -> None:
    assert said("fdi", "learning", horizon=20)[0].startswith("onset_s = (0.0, 3.0) s lets 33% of the attacks")
    assert said("fdi", "drawn", gain_spread=0.5) == []
    assert said("fdi", "learning", gain_spread=0.5, derivative_gain=4.5) == [
        "gain_spread = 0.5 draws gains with which the platoon is unstable without any attack, with dt_s = 0.1: lower "
        "one of them"
    ]


def test_ranges_are_other_where_they_leave_those_of_every_preset() -> None:
    disbanding = find_problem("disbanding")
    for tau_s, others in ((0.3, []), ((0.1, 0.4), []), (0.6, ["tau_s"]), ((0.05, 0.3), ["tau_s"])):
        config = disbanding.config("learning", {"tau_s": tau_s})
        assert other_fields(config, disbanding.presets, disbanding.system) == others


@pytest.mark.parametrize(
    ("problem", "role", "policy", "changes", "what"),
    [
        ("hvac", "defender", "bayes", {"noise_std_c": 1.0, **THRESHOLD}, "14 numbers of Bayes were found"),
        ("rogue", "attacker", "switching", {"vehicle_length_m": 3.0}, "numbers of Switching were found"),
        ("rogue", "attacker", 'mixture?policies=["none","switching"]', {"vehicle_length_m": 3.0}, "of Switching"),
        ("disbanding", "defender", "cacc", {"desired_speed_mps": 20.0}, "numbers of"),
        ("fdi", "defender", "hypotheses", {"range_noise_m": 1.0}, "numbers of Hypotheses"),
        ("hvac", "defender", "zoo:hvac-defense", {"noise_std_c": 1.0, **THRESHOLD}, "a network was trained"),
    ],
)
def test_numbers_of_a_policy_that_were_found_for_other_systems(
    problem: str, role: Any, policy: str, changes: dict[str, Any], what: str
) -> None:
    found, (name, *_) = find_problem(problem), changes
    foreign, usual = found.config("learning", changes), found.config("learning", {})
    with pytest.warns(ForeignSettingWarning) as told:
        found.policy(policy, found.game(foreign, 1), role)
    (sentence,) = (str(each.message) for each in told)
    assert what in sentence
    assert f"for other systems than one with {name} = {changes[name]}, and may play badly here" in sentence
    with warnings.catch_warnings():
        warnings.simplefilter("error", ForeignSettingWarning)
        found.policy(policy, found.game(usual, 1), role)


def test_every_door_tells_once_and_the_command_line_without_the_place(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.warns(ForeignSettingWarning, match="onset_s"):
        gymnasium.make("cps_envs:cps_envs/FdiDefense-v0", horizon=20, preset="learning", interface="native")
    with pytest.warns(ForeignSettingWarning, match="onset_s"):
        gymnasium.make_vec("cps_envs:cps_envs/FdiDefense-v0", 2, horizon=20, preset="learning", interface="native")
    show_warning(ForeignSettingWarning("numbers"), ForeignSettingWarning, "a/file.py", 12)
    assert capsys.readouterr().err == "Note: numbers.\n"
