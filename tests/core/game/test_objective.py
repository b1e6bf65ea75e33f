"""What the attacker is paid: a word, weights of metrics, or a function of their increments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import pytest

import cps_envs
from cps_envs import config, find_problem, learning_env, play_episodes
from cps_envs.core.declare.objective import Increments
from cps_envs.core.errors import ConfigurationError, UnknownNameError, UntrustedCodeError
from cps_envs.core.game.objective import Objective
from cps_envs.core.types import FloatArray
from cps_envs.disbanding_v0 import swarm_env as disbanding_swarm
from cps_envs.fdi_v0 import swarm_env as fdi_swarm
from cps_envs.hvac_v0 import parallel_env
from cps_envs.hvac_v0 import swarm_env as hvac_swarm
from cps_envs.rogue_v0 import swarm_env as rogue_swarm
from tests.core.toy import ToyConfig, ToyGame

SHORT: Mapping[str, Mapping[str, Any]] = {
    "hvac": {"num_steps": 260, "onset_step": 0},
    "rogue": {"duration_s": 12.0, "onset_s": 1.0, "attack_share": 1.0},
    "fdi": {"paid_pair": "any"},
    "disbanding": {"duration_s": 8, "num_platoons": 3, "attack_budget": 1},
}
WEIGHTS = {
    "hvac": {"a_impact": 1.0, "energy_kwh": 0.1},
    "rogue": {"damage": 1.0, "formation_cost_s": 0.5, "reference_error_m": -0.25},
    "fdi": {"worst_impact_mps": 1.0, "time_s": 0.1, "alarm_cost_mps": 2.0},
    "disbanding": {"velocity_error_all": 2.0, "collided": 0.5},
}
PLAYERS: Mapping[str, Any] = {
    "hvac": {"attacker": "random", "defender": "none"},
    "rogue": {"attacker": "random", "defender": "none"},
    "fdi": {"attacker": "random", "defender": "random"},
    "disbanding": {"attacker": "random", "defender": "random"},
}
pytestmark = pytest.mark.filterwarnings("ignore:payoff is not the one")


def surplus(increments: Increments) -> FloatArray:
    """Not to be had by weights: what is more than 0.01 in a game step counts, and each game step costs."""
    return np.maximum(increments["a_impact"] - 0.01, 0.0) - 0.001


def played(name: str, payoff: Any) -> dict[str, Any]:
    problem = find_problem(name)
    config = problem.config("learning", {**SHORT[name], "payoff": payoff})
    return play_episodes(problem, config, PLAYERS[name], range(3))


@pytest.mark.parametrize("name", SHORT)
def test_the_return_is_the_weighted_sum_of_the_metrics_at_the_end(name: str) -> None:
    own, weighted = played(name, find_problem(name).presets["paper"].payoff), played(name, WEIGHTS[name])
    for metric in own.keys() - {"return", "bound_valid"}:
        np.testing.assert_array_equal(own[metric], weighted[metric])  # what is paid changes nothing of what happens
    expected = sum(weight * weighted[metric] for metric, weight in WEIGHTS[name].items())
    np.testing.assert_allclose(weighted["return"], expected, rtol=1e-9, atol=1e-12)
    assert (weighted["return"] != own["return"]).any()


def test_a_function_of_increments_equals_the_weights_that_say_the_same() -> None:
    weighted = played("hvac", {"discomfort_h": 2.0, "a_impact": -1.0})
    called = played("hvac", lambda grown: 2.0 * grown["discomfort_h"] - grown["a_impact"])
    np.testing.assert_allclose(called["return"], weighted["return"], rtol=1e-9)


def test_a_function_is_asked_at_every_game_step_whatever_the_stride() -> None:
    problem, asked = find_problem("hvac"), []

    def steps(increments: Increments) -> FloatArray:
        asked.append(set(increments))
        return np.ones(len(increments["a_impact"]))

    config = problem.config("paper", {"num_steps": 210, "payoff": steps})
    match = problem.match(config, 2, {})
    match.reset(np.ones(2, np.bool_), [np.random.default_rng(b) for b in range(2)])
    assert match.step({}, np.array([True, False]), 7).tolist() == [7.0, 0.0]
    assert len(asked) == 7
    assert asked[0] == set(match.game.metrics())


def test_both_forms_are_zero_sum_and_words_name_weights() -> None:
    env = parallel_env(preset="paper", num_steps=210, onset_step=0, payoff="energy")
    env.reset(seed=3)
    paid = []
    while env.agents:
        _, rewards, *_, infos = env.step({agent: env.action_space(agent).sample() * 0 for agent in env.agents})
        assert sum(rewards.values()) == 0.0
        paid.append(rewards["attacker_0"])
    assert sum(paid) == pytest.approx(infos["attacker_0"]["attack_kwh"], rel=1e-9)
    weighted = find_problem("hvac").config("paper", {"payoff": {"attack_kwh": 1.0}})
    assert weighted.payoff == (("attack_kwh", 1.0),)


@pytest.mark.parametrize(
    ("make", "options"),
    [
        (hvac_swarm, {"payoff": {"energy_kwh": 1.0}, "num_steps": 260, "onset_step": 10}),
        (rogue_swarm, {"payoff": {"formation_cost_s": 1.0}}),
        (fdi_swarm, {"payoff": {"time_s": 1.0}}),
        (disbanding_swarm, {"payoff": {"velocity_error_all": 2.0}}),
    ],
)
def test_defending_teams_share_another_payoff_alike(make: Any, options: dict[str, Any]) -> None:
    env = make(shared_pay=False, **options)
    env.reset(seed=1)
    actions = {agent: env.neutral_action(agent) for agent in env.agents}
    metric, weight = next(iter(options["payoff"].items()))
    rewards, infos = env.step(actions)[1::3]
    shares = list(rewards.values())
    assert len(set(shares)) == 1
    assert sum(shares) == pytest.approx(-weight * next(iter(infos.values()))[metric], rel=1e-9)
    assert shares[0] < 0


def test_a_copy_to_plan_on_goes_on_being_paid_alike() -> None:
    problem = find_problem("hvac")
    game = problem.game(problem.config("paper", {"num_steps": 210, "onset_step": 0, "payoff": "energy"}), 1)
    envs = np.ones(1, np.bool_)
    game.reset(envs, [np.random.default_rng(0)])
    game.advance({}, envs, 50)
    copy = game.model(0, 2)
    assert copy.advance({}, np.ones(2, np.bool_), 10).tolist() == [game.advance({}, envs, 10)[0]] * 2


def test_learners_are_paid_a_payoff_that_may_be_negative() -> None:
    env = learning_env("HvacDefense", 2, payoff={"a_impact": -1.0}, pay_power=0.5, num_steps=260, onset_step=0)
    env.reset(seed=0, options={"staggered": False})
    rewards = sum(env.step(np.full(env.num_envs, env.neutral_action))[1] for _ in range(3))
    assert np.all(rewards > 0)


def test_certificates_and_shipped_numbers_say_that_they_are_of_the_own_payoff() -> None:
    fdi = find_problem("fdi")
    for payoff, valid in (("goal", 1.0), ({"impact_speed_mps": 1.0}, 0.0)):
        config = fdi.config("paper", {"payoff": payoff})
        assert fdi.game(config, 1).metrics() is not None
        assert play_episodes(fdi, config, {}, [0])["bound_valid"].tolist() == [valid]
    with pytest.warns(UserWarning, match="certified bounds, frozen scores, and the numbers and networks"):
        gymnasium.make("cps_envs/FdiAttack-v0", preset="paper", payoff={"time_s": 1.0})


@pytest.mark.parametrize(
    ("payoff", "message"),
    [
        ({"a_impct": 1.0}, "no metric 'a_impct' in this configuration. Did you mean 'a_impact'"),
        ({"a_impact": "much"}, "the weight of a_impact is 'much', but must be a number"),
        ({"a_impact": float("nan")}, "the weight of a_impact is nan"),
        ({"a_impact": True}, "the weight of a_impact is True"),
        ({"a_impact": 1e12}, "within"),
        ({"a_impact": 0.0}, "pays nothing"),
        ({}, "pays nothing"),
        ("impakt", "is not one of impact, discomfort, energy. Did you mean 'impact'"),
        (3.0, "must be one of impact, discomfort, energy; weights"),
        (("a_impact", "energy_kwh"), "weights of metrics"),
        ("json:nothing", "no function can be imported"),
        ("json:decoder", "is no function"),
    ],
)
def test_a_payoff_that_cannot_be_is_refused_at_make(payoff: Any, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CPS_ENVS_TRUST", "1")
    with pytest.raises((ConfigurationError, UnknownNameError), match=message):
        gymnasium.make("cps_envs/HvacAttack-v0", preset="paper", payoff=payoff)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda grown: grown["energy"], "no metric 'energy'. Did you mean 'energy_kwh'"),
        (lambda grown: 1.0, "must return 1 finite numbers, one for each environment"),
        (lambda grown: grown["a_impact"] * np.nan, "finite numbers"),
        (lambda grown: grown["a_impact"].nothing, "the function failed: AttributeError"),
    ],
)
def test_a_function_that_fails_is_named(function: Any, message: str) -> None:
    env = gymnasium.make("cps_envs/HvacAttack-v0", preset="paper", payoff=function)
    env.reset(seed=0)
    with pytest.raises(ConfigurationError, match=message):
        env.step(env.action_space.sample())


def test_a_metric_that_is_not_finite_yet_cannot_be_paid() -> None:
    paid = Objective((("gap_m", 1.0),), {"gap_m": np.zeros(2)})
    with pytest.raises(ConfigurationError, match="'gap_m' is not finite yet"):
        paid.pay({"gap_m": np.array([1.0, np.inf])}, np.ones(2, np.bool_))


@dataclass(frozen=True)
class PaidConfig(ToyConfig):
    payoff: Any = config.objective({"own": {}, "near": {"closeness": 2.0}}, source="chosen")  # noqa: RUF009


class PaidToy(ToyGame):
    def __init__(self, config: PaidConfig, num_envs: int) -> None:
        super().__init__(config, num_envs)
        self.pay_as_configured()


def test_a_problem_of_ones_own_takes_words_and_weights_too() -> None:
    paid = {}
    for payoff in ("own", "near", (("closeness", 1.0), ("fee", 1.0))):
        game = PaidToy(PaidConfig(payoff=payoff), 2)
        game.reset(np.ones(2, np.bool_), [np.random.default_rng(b) for b in range(2)])
        paid[payoff] = game.advance({}, np.ones(2, np.bool_), 3)
    np.testing.assert_allclose(paid["own"], paid[("closeness", 1.0), ("fee", 1.0)])
    np.testing.assert_allclose(paid["near"], 2 * game.metrics()["closeness"])


def test_a_text_that_names_a_function_needs_consent(monkeypatch: pytest.MonkeyPatch) -> None:
    named = f"{__name__}:surplus"
    monkeypatch.delenv("CPS_ENVS_TRUST", raising=False)
    with pytest.raises(UntrustedCodeError, match="runs code"):
        played("hvac", named)
    monkeypatch.setenv("CPS_ENVS_TRUST", "1")
    cps_envs.trust()
    assert played("hvac", named)["return"].tolist() == played("hvac", surplus)["return"].tolist()
