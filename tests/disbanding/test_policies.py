"""The analytic attackers and defenders as policies, through the environments' own observations."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding.corrections import sight_for
from cps_baselines.disbanding.families import FEEDBACK
from cps_baselines.disbanding.feedback import LinearFeedback, shipped_weights
from cps_baselines.disbanding.heuristic_policy import FORESIGHT, sweep_row
from cps_baselines.disbanding.plans import RandomPlan, plan_array
from cps_baselines.family import play_family
from cps_envs.core.errors import ConfigurationError
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.disbanding.start import nominal_constants
from tests import episodes

TAUS_S = (0.1, 0.3, 0.5)

# Spec 7.5: linear feedback with the coefficients printed there; leaders, others.
PRINTED_FEEDBACK = [[0.48, 0.10, 0.78, 0.43, 0.03, -0.12], [0.05, 0.67, 0.09, 0.13, 0.48, 0.63]]
play = partial(episodes.play, DISBANDING)
spec_of = partial(episodes.spec_of, DISBANDING)


@cache
def outcome(defender: str, tau_s: float, attacker: str = "lead", **overrides: Any) -> dict[str, float]:
    """The metrics of an episode of preset `paper`."""
    found = play(attacker, defender, tau_s=tau_s, **overrides)
    return {name: float(values[0]) for name, values in found.items()}


def errors_of(defender: str, metric: str = "velocity_error_intact", **rest: Any) -> list[float]:
    return [outcome(defender, tau_s, **rest)[metric] for tau_s in TAUS_S]


# Spec 4.5, through rule 2.7; a policy reads float32 observations, hence its tolerance of 0.5 (spec 9) and more where
# vehicles have collided.
@pytest.mark.parametrize(
    ("defender", "expected", "tolerance"),
    [("heuristic", (25.36, 27.21, 32.88), (0.5, 0.5, 1.0)), ("mpc", (21.98, 24.52, 28.50), (0.1, 0.1, 0.1))],
)
def test_mitigations_through_the_correction_rule(
    defender: str, expected: tuple[float, ...], tolerance: tuple[float, ...]
) -> None:
    assert np.all(np.abs(np.subtract(errors_of(defender), expected)) <= tolerance)


@pytest.mark.slow
def test_heuristic_at_every_step_agrees_with_the_reference() -> None:
    expected = (25.44, 26.84, 28.75)
    assert np.all(np.abs(np.subtract(errors_of("heuristic", control_period_s=0.01), expected)) <= 0.5)


def test_a_longer_horizon_of_the_heuristic_is_another_policy() -> None:
    names = ("heuristic", "heuristic?horizon_s=0.5", "heuristic?horizon_s=1")
    unnamed, usual, longer = (outcome(name, TAUS_S[0])["velocity_error_intact"] for name in names)
    assert usual == unnamed
    assert longer == pytest.approx(usual, abs=4.0)  # spec: 0.5 to 2 s give similar errors
    assert longer != usual


def test_the_heuristic_can_know_that_collision_avoidance_is_off() -> None:
    constants = nominal_constants(DISBANDING.config("paper", {"num_platoons": 2, "vehicles_per_platoon": 2}))
    sight = sight_for(4)  # vehicle 2 is nearer than r_0 without closing in, and vehicle 3 closes in on it
    sight.speed[:] = 30.0, 30.0, 30.0, 30.1
    sight.gap[1:] = 5.0, 0.5, 5.0
    sight.relative_speed[3] = -0.1
    sight.law_command[2:] = 1.0
    sight.mitigable[2:] = True
    with_avoidance, without = np.zeros(4), np.zeros(4)
    sweep_row(sight, constants, FORESIGHT, True, with_avoidance)
    sweep_row(sight, constants, FORESIGHT, False, without)
    # In 0.5 s a vehicle that brakes fully falls back by 0.5 m, one that accelerates by the law gains 0.1 m (2.13).
    assert with_avoidance[3] == pytest.approx((-0.5 - 0.05) / 0.125 - 1.0)
    assert without[3] == pytest.approx((0.1 - 0.05) / 0.125 - 1.0)


def test_printed_feedback_gives_the_printed_errors() -> None:
    for tau_s, expected in zip(TAUS_S, (18.37, 18.86, 19.69), strict=True):
        feedback = LinearFeedback(spec_of("defender", tau_s=tau_s), PRINTED_FEEDBACK)
        found = play("lead", feedback, tau_s=tau_s)
        assert found["velocity_error_intact"][0] == pytest.approx(expected, abs=0.05)
        assert found["collided"][0] == 0


def test_copy_comes_close_to_the_vehicle_that_it_copies() -> None:
    # The error of the copied vehicle itself: 18.91 / 19.35 / 20.14 (spec 7.5).
    assert errors_of("copy") == pytest.approx([18.91, 19.35, 20.14], abs=0.3)
    assert errors_of("copy", "collided") == [0, 0, 0]


def assert_beats_the_paper_s(defender: str, **setting: Any) -> None:
    found, heuristic, mpc = (
        errors_of(name, "velocity_error_all", **setting) for name in (defender, "heuristic", "mpc")
    )
    assert np.all(np.less(found, np.minimum(heuristic, mpc)))


@pytest.mark.parametrize("defender", ["copy", "feedback", "mpc_tuned"])
def test_stronger_defenders_beat_the_paper_s(defender: str) -> None:
    assert_beats_the_paper_s(defender)


@pytest.mark.slow
@pytest.mark.parametrize("attack", ["lead", "table_2_3"])
@pytest.mark.parametrize("defender", ["copy", "feedback", "mpc_tuned"])
def test_stronger_defenders_beat_the_paper_s_in_all_twelve_cells(defender: str, attack: str) -> None:
    for gap_m in (5.0, 4.0):
        assert_beats_the_paper_s(defender, attacker=attack, desired_gap_m=gap_m)


def test_mpc_refuses_a_lag_that_its_model_cannot_follow() -> None:
    with pytest.raises(ValueError, match=r"period_s <= 0\.08 s or a larger tau_s"):
        play("lead", "mpc", tau_s=0.04, duration_s=5.0)


def test_plans_strike_when_they_say() -> None:
    assert outcome("none", 0.1, "plan?events=[[10,1],[3,7]]", duration_s=10.0)["disbanded_platoons"] == 2


def test_a_plan_needs_times() -> None:
    with pytest.raises(ConfigurationError, match="start at 1 s"):
        plan_array([(10, float("nan"))], 10)


def test_front_plans_follow_the_number_of_platoons() -> None:
    found = play("lead", "none", seeds=range(6), preset="easy", num_platoons=(6, 10), duration_s=5.0)
    assert np.all(found["disbanded_platoons"] == 1)


def test_random_plans_differ_by_seed_and_repeat() -> None:
    times = [RandomPlan(spec_of("attacker")).begin([np.random.default_rng(seed)], [{}])[0] for seed in (1, 2, 1)]
    assert not np.array_equal(times[0], times[1])
    assert np.array_equal(times[0], times[2])
    assert np.isfinite(times[0]).sum() == 2


@pytest.mark.parametrize("latest_s", [0.5, -1, float("nan"), float("inf")])
def test_random_plans_need_a_time_to_attack_in(latest_s: float) -> None:
    with pytest.raises(ConfigurationError, match=r"latest_s = .* must be 1 or more"):
        RandomPlan(spec_of("attacker"), latest_s=latest_s)


def test_random_plans_use_the_front_with_a_bias() -> None:
    policy = RandomPlan(spec_of("attacker"), front_bias=200.0)
    times = policy.begin([np.random.default_rng(seed) for seed in range(20)], [{}] * 20)[0]
    assert np.all(np.isfinite(times[:, 8:]))


def test_the_script_spread_follows_each_environment_s_budget() -> None:
    def disbanding_s(seeds: Sequence[int], **overrides: Any) -> Any:
        return episodes.watched(
            DISBANDING,
            lambda game: game.state.disbanding_s.copy(),
            "spread",
            "none",
            seeds,
            "easy",
            tau_s=0.3,
            **overrides,
        )[-1]

    drawn = disbanding_s(range(8), attack_budget=(1, 3))
    fixed = {budget: disbanding_s([0], attack_budget=budget)[0] for budget in (1, 2, 3)}
    budgets = np.isfinite(drawn).sum(axis=1)
    assert set(budgets) == {1, 2, 3}
    for budget, times in zip(budgets, drawn, strict=True):
        np.testing.assert_allclose(times, fixed[budget])


def test_feedback_takes_one_set_of_weights_per_environment() -> None:
    weights = np.stack([shipped_weights(), np.array(PRINTED_FEEDBACK)])
    feedback = LinearFeedback(spec_of("defender"), weights)
    both = play("lead", feedback, seeds=(0, 0), duration_s=30.0)["velocity_error_all"]
    alone = [
        play("lead", LinearFeedback(spec_of("defender"), part), duration_s=30.0)["velocity_error_all"][0]
        for part in weights
    ]
    assert both.tolist() == alone


def test_feedback_refuses_weights_of_another_shape() -> None:
    with pytest.raises(ValueError, match=r"\(2, 6\)"):
        LinearFeedback(spec_of("defender"), np.zeros((2, 5)))


def test_a_search_of_feedback_begins_where_it_does_nothing() -> None:
    config = DISBANDING.config("paper", {"duration_s": 30.0})
    values = np.stack([FEEDBACK.row({})[0], np.ravel(shipped_weights())])
    found = play_family(FEEDBACK, DISBANDING, config, "lead", values, (0, 0))["velocity_error_all"]
    alone = [play("lead", name, duration_s=30.0)["velocity_error_all"][0] for name in ("none", "feedback")]
    assert found.tolist() == alone
