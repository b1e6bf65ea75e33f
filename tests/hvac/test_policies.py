"""Attackers and defenders of chapter 4 as policies: what they do, how they draw, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import pytest

from cps_baselines.hvac.moving_target import Mtd1, Mtd2, encoded_mean
from cps_baselines.hvac.replacing import RandomReadings
from cps_baselines.hvac.stealthy import loss_response
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import RoleSpec
from cps_envs.core.types import Array
from cps_envs.hvac.building import discretise
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.sensors import sensor_sets
from tests import episodes
from tests.hvac.games import SHORT, play

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
MODEL = 15  # the last choice with four sensors
spec_of = partial(episodes.spec_of, HVAC)


def fresh(policy: Any, envs: int) -> tuple[Array, ...] | None:
    return policy.begin([np.random.default_rng(b) for b in range(envs)], [{}] * envs)


def defender_sees(
    spec: RoleSpec,
    envs: int,
    *,
    ready: bool = True,
    passes: Sequence[int] = (),
    better: Sequence[int] = (),
    means: Array | None = None,
) -> Array:
    """Observations that are neutral but for what a moving target reads."""
    observation = np.zeros((envs, spec.fields.size), np.float32)
    slices, sets = spec.fields.slices, len(sensor_sets(spec.config))
    observation[:, slices["ready"]] = 1 if ready else -1
    for name, marked in (("passes", passes), ("better_half", better)):
        observation[:, slices[name]] = np.where(np.isin(np.arange(1, sets + 1), marked), 1, -1)
    if means is not None:
        observation[:, slices["mean_residual"]] = [encoded_mean(spec, mean) for mean in means]
    return observation


# What the attackers do.


def forged_readings(attack: str, age: int = 0, preset: str = "paper", **overrides: Any) -> tuple[Array, HvacGame]:
    """Readings of a noisy game in which all sensors are compromised, `age` steps after the onset, and the game."""
    config = HVAC.config(preset, SHORT | {"num_compromised": 4} | overrides)
    match = HVAC.match(config, 2, {"attacker": attack, "defender": "none"})
    match.reset(np.ones(2, bool), [np.random.default_rng(seed) for seed in (0, 1)])
    for _ in range(int(config.onset_step) + age):
        match.step({}, np.ones(2, bool), 1)
    return match.game.state.reading, match.game


@pytest.mark.parametrize("age", [0, 1, 17, 40])
def test_signals_that_replace_readings(age: int) -> None:
    assert forged_readings("constant", age)[0] == pytest.approx(np.full((2, 4), 22.0))
    assert forged_readings("constant?reading_c=30", age)[0] == pytest.approx(np.full((2, 4), 30.0))
    sine = 22 + 3 * np.sin(2 * np.pi * age / 60)
    assert forged_readings("sine", age)[0] == pytest.approx(np.full((2, 4), sine))


@pytest.mark.parametrize("age", [0, 1, 17, 40])
@pytest.mark.parametrize(
    ("attack", "bias"),
    [
        ("ramp", lambda h: 2 * h),
        ("ramp?rate_c_per_h=0.7", lambda h: 0.7 * h),
        ("ramp?rate_c_per_h=100", lambda h: min(100 * h, 15)),
        ("root_ramp", lambda h: 20 * (h / 10) ** 0.5),
    ],
)
def test_ramps_make_readings_too_cold(age: int, attack: str, bias: Callable[..., Any]) -> None:
    reading, game = forged_readings(attack, age)
    true = game.state.temperature
    assert reading == pytest.approx(np.maximum(true - bias(age / 30), 10))
    noisy, game = forged_readings(attack + ("&" if "?" in attack else "?") + "keep_noise=true", age)
    assert noisy == pytest.approx(np.maximum(game.state.measured - bias(age / 30), 10))


def test_the_default_rate_depends_on_whether_a_sensor_is_left() -> None:
    reading, game = forged_readings("ramp", 30, num_compromised=3)
    assert (game.state.temperature - reading)[:, [0, 1, 3]] == pytest.approx(np.full((2, 3), 0.7))


def test_rates_are_drawn_per_environment_and_kept() -> None:
    biases = []
    for age in (15, 30):
        reading, game = forged_readings("ramp?rate_c_per_h=[0.3,1.0]", age)
        biases.append((game.state.temperature - reading)[:, 0])
    assert biases[1] == pytest.approx(2 * biases[0])
    assert biases[1][0] != pytest.approx(biases[1][1])
    assert all(0.3 <= bias <= 1.0 for bias in biases[1])


def test_the_mimic_shows_a_loss_of_heat() -> None:
    """x = (I - A)^-1 (I - A^k) B d solves x(k + 1) = A x(k) + B d from x(0) = 0."""
    config = HVAC.config("paper", SHORT)
    building = discretise(config)
    eye = np.eye(4)
    for k in (0, 1, 2, 40):
        steady = np.linalg.solve(eye - building.A, building.B * 100)
        expected = (eye - np.linalg.matrix_power(building.A, k)) @ steady
        assert loss_response(config, 100.0)[k] == pytest.approx(expected, abs=1e-10)
        reading, game = forged_readings("mimic", k)
        assert game.state.temperature - reading == pytest.approx(np.stack([expected] * 2), abs=1e-9)


def test_random_readings_are_fresh_for_each_step_and_sensor() -> None:
    policy = RandomReadings(spec_of("attacker"))
    (drawn,) = fresh(policy, 3)
    assert drawn.shape == (3, 720, 4)
    assert 18 <= drawn.min() < 18.1
    assert 25.9 < drawn.max() <= 26
    assert drawn.std() == pytest.approx(8 / np.sqrt(12), rel=0.03)
    flat = drawn.transpose(0, 2, 1).reshape(12, 720)
    correlation = np.corrcoef(np.vstack([flat[:, 1:], flat[:, :-1]]))
    assert np.abs(correlation - np.eye(24)).max() < 0.15
    shown = {forged_readings("random", age)[0].tobytes() for age in range(5)}
    assert len(shown) == 5


@pytest.mark.parametrize("attack", ["random", "ramp?rate_c_per_h=[0.3,1.0]"])
def test_attackers_that_draw_play_without_being_begun(attack: str) -> None:
    policy = resolve_policy(attack, spec_of("attacker"))
    actions, state = policy.predict(np.zeros((3, policy.spec.fields.size), np.float32))
    assert actions.shape == (3, 5)
    assert state is not None


# How the defenders choose.


@pytest.mark.parametrize("policy", ["mtd1", "mtd2", "fixed", "model_only", "mtd2?threshold_c2=1.0"])
def test_least_squares_until_the_window_is_full(policy: str) -> None:
    spec = spec_of("defender")
    found = resolve_policy(policy, spec)
    observation = defender_sees(spec, 4, ready=False, passes=[3], better=[3])
    assert found.predict(observation, fresh(found, 4))[0].tolist() == [MODEL] * 4


def algorithm_4(passes: list[int], generator: np.random.Generator) -> int:
    """As the paper prints it: candidates without replacement until two pass, then either."""
    order = generator.permutation(14) + 1
    found = [candidate for candidate in order if candidate in passes][:2]
    return found[generator.integers(len(found))]


@pytest.mark.parametrize("marked", [[1, 2, 3, 8, 9, 10, 11], [4, 14], [5]])
def test_draws_are_those_of_algorithm_4_and_uniform(marked: list[int]) -> None:
    spec, envs = spec_of("defender"), 21_000
    for policy, seen in ((Mtd2(spec), {"passes": marked}), (Mtd1(spec), {"better": marked})):
        state = (np.random.default_rng(0).random((envs, 1)), np.zeros(envs, np.int64))
        choices, _ = policy.predict(defender_sees(spec, envs, **seen), state)
        assert set(choices) == set(marked)
        counts = np.array([(choices == each).sum() for each in marked])
        assert counts == pytest.approx(np.full(len(marked), envs / len(marked)), rel=0.07)
    generator = np.random.default_rng(1)
    literal = [algorithm_4(marked, generator) for _ in range(envs)]
    assert [literal.count(each) for each in marked] == pytest.approx(counts, rel=0.07)


def test_draws_are_independent_between_steps_and_environments() -> None:
    spec = spec_of("defender")
    policy = Mtd2(spec)
    observation, state, rounds = defender_sees(spec, 4, passes=range(1, 15)), fresh(policy, 4), []
    for _ in range(700):
        choices, state = policy.predict(observation, state)
        rounds.append(choices)
    table = np.array(rounds)
    pairs = np.corrcoef(np.vstack([table[1:].T, table[:-1].T]))
    assert np.abs(pairs - np.eye(8)).max() < 0.15
    again, _ = policy.predict(observation, fresh(policy, 4))
    assert (again == rounds[0]).all()


def test_predicting_leaves_the_given_state_alone() -> None:
    spec = spec_of("defender")
    policy, observation = Mtd2(spec), defender_sees(spec, 2, passes=range(1, 15))
    state = fresh(policy, 2)
    first, _ = policy.predict(observation, state)
    assert (policy.predict(observation, state)[0] == first).all()
    beyond = (state[0], state[1] + 100_000)  # a caller that never begins episodes
    assert set(policy.predict(observation, beyond)[0]) <= set(range(1, 15))


def test_fallbacks_where_no_set_passes() -> None:
    spec = spec_of("defender")
    means = np.full(14, 3.0)
    means[8] = 2.0
    observation = defender_sees(spec, 2, means=means)
    assert Mtd2(spec).predict(observation)[0].tolist() == [9, 9]
    assert Mtd2(spec, fallback="model").predict(observation)[0].tolist() == [MODEL] * 2
    assert Mtd2(spec, threshold_c2=2.1).predict(observation)[0].tolist() == [9, 9]
    assert Mtd2(spec, fallback="model", threshold_c2=1.9).predict(observation)[0].tolist() == [MODEL] * 2


def test_own_threshold_takes_the_place_of_the_configuration_s() -> None:
    plain = play("constant", "mtd2", seeds=range(3))
    same = play("constant", "mtd2?threshold_c2=0.418", seeds=range(3))
    assert (plain["a_impact"] == same["a_impact"]).all()
    configured = play("constant", "mtd2", seeds=range(3), thresholds_c2=(1.0, 1.0))["a_impact"]
    assert play("constant", "mtd2?threshold_c2=1.0", seeds=range(3))["a_impact"] == pytest.approx(configured, rel=1e-9)
    assert (configured != plain["a_impact"]).any()


def test_fixed_set() -> None:
    spec = spec_of("defender")
    assert [resolve_policy(name, spec).choice for name in ("fixed", "fixed?sensors=[2]", "fixed?sensors=[3,1]")] == [
        14,
        4,
        10,
    ]
    chosen = play("none", "fixed?sensors=[2]", seeds=range(2))
    assert chosen["distinct_sets"].tolist() == [1, 1]
    assert chosen["model_steps"].tolist() == [0, 0]


def test_model_only_cannot_be_reached_after_the_window_is_full() -> None:
    free = play("none", "model_only")["a_impact"]
    assert free.mean() == pytest.approx(1.17, rel=0.05)
    for attack in ("constant", "ramp", "random"):
        assert (play(attack, "model_only", num_compromised=4)["a_impact"] == free).all()


# Everybody.


@pytest.mark.parametrize(
    ("attacker", "defender"), [("random", "mtd2"), ("ramp?rate_c_per_h=[0.3,1.0]", "mtd1"), ("mixture", "mixture")]
)
def test_an_environment_plays_as_the_same_episode_alone(attacker: str, defender: str) -> None:
    if attacker == "mixture":
        attacker = HVAC.opponents["easy"]["attacker"]
        defender = 'mixture?policies=["mtd1","mtd2","model_only"]'
    together = play(attacker, defender, seeds=(4, 5, 6), preset="easy")
    for b, seed in enumerate((4, 5, 6)):
        alone = play(attacker, defender, seeds=(seed,), preset="easy")
        assert {name: values[b] for name, values in together.items()} == {
            name: values[0] for name, values in alone.items()
        }


def test_an_easy_defender_meets_days_without_attack_scripted_and_stealthy_ones() -> None:
    mixture = resolve_policy(HVAC.opponents["easy"]["attacker"], spec_of("attacker", "easy"))
    shares = mixture.probabilities
    assert shares[0] == pytest.approx(0.15)
    assert shares[1:4].sum() == pytest.approx(0.3)


@pytest.mark.parametrize("reference", ["ramp?keep_noise=true", "mimic?keep_noise=true"])
def test_attackers_that_keep_the_noise_do_not(reference: str) -> None:
    outcome = play(reference, "mtd2", attack_action="bias")
    assert outcome["a_impact"].mean() > 10
