"""What the interfaces promise beyond the conformance checks: arguments, messages, documentation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium import error
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.game.game import Game
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv
from cps_envs.core.policies.policy import AnalyticPolicy, Idle, Policy
from tests.core.toy import TOY, ToyAttackEnv, ToyAttackVectorEnv, ToyConfig, ToyDefenseEnv, ToyGame
from tests.core.toy_policies import Chase


def test_ids_follow_name_side_version_and_namespace() -> None:
    assert [TOY.env_id(role) for role in ("attacker", "defender")] == ["toys/ToyAttack-v0", "toys/ToyDefense-v0"]


def test_docstrings_hold_the_tables() -> None:
    assert "| 0-1 | `own` | -4 | 4 | m | own position |" in (ToyAttackEnv.__doc__ or "")
    assert "| `catch_fee` | 0.5 |" in (ToyAttackEnv.__doc__ or "")
    assert "{" not in (ToyDefenseEnv.__doc__ or "")


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"preset": "papers"}, "toy has no preset 'papers'. Did you mean 'paper'"),
        ({"speed": 1}, "ToyConfig has no field 'speed'"),
        ({"mood": "clam"}, "Did you mean 'calm'"),
    ],
)
def test_wrong_arguments(kwargs: dict[str, Any], message: str) -> None:
    for make in (ToyAttackEnv, lambda **kw: RolesParallelEnv(TOY, **kw), lambda **kw: SwarmEnv(TOY, "defender", **kw)):
        with pytest.raises(ConfigurationError, match=message):
            make(**kwargs)


def test_wrong_numbers_of_environments_seeds_and_modes() -> None:
    with pytest.raises(ConfigurationError, match="num_envs = 0 must be a whole number, at least 1"):
        ToyAttackVectorEnv(0)
    with pytest.raises(ValueError, match="3 environments, 2 seeds"):
        ToyAttackVectorEnv(3).reset(seed=[1, 2])
    with pytest.raises(ValueError, match="Sometimes"):
        ToyAttackVectorEnv(1, autoreset="Sometimes")
    with pytest.raises(UnknownNameError, match="toy has no defender policy 'nobody'"):
        ToyAttackEnv(opponent="nobody")


@pytest.mark.parametrize(
    "kwargs",
    [{"preset": preset} for preset in ([], [1], 3)]
    + [{"num_threads": count} for count in (None, 1.5, True, "two")]
    + [{"autoreset": mode} for mode in (None, [1], 7, "none")]
    + [{"interface": name} for name in (3, ["native"], "natve")]
    + [{"frame_skip": count} for count in (0, 1.5, True, "2")],
    ids=str,
)
def test_arguments_of_another_type_are_named(kwargs: dict[str, Any]) -> None:
    (name,) = kwargs
    with pytest.raises(ConfigurationError, match=f"has no {name} |{name} = .* must be "):
        ToyAttackVectorEnv(2, **kwargs)


@pytest.mark.parametrize("seeds", [[1.5, 2], [True, 2], [[1], 2], ["1", "2"], np.array([1.5, 2.0])], ids=str)
def test_seeds_that_are_no_whole_numbers_are_refused(seeds: Any) -> None:
    with pytest.raises(ValueError, match="is no whole number"):
        ToyAttackVectorEnv(2).reset(seed=seeds)
    assert ToyAttackVectorEnv(2).reset(seed=np.array([1, 2]))  # type: ignore[arg-type]


@pytest.mark.parametrize("options", [[1], "mask", 3], ids=str)
def test_options_of_every_interface_are_dictionaries(options: Any) -> None:
    for env in (ToyAttackEnv(), ToyAttackVectorEnv(2), RolesParallelEnv(TOY), SwarmEnv(TOY, "defender")):
        with pytest.raises(ValueError, match="must be a dictionary, such as"):
            env.reset(options=options)


@pytest.mark.parametrize("actions", [None, 3, "attacker_0", ["attacker_0", "defender_0"]], ids=str)
def test_actions_of_agents_are_a_dictionary(actions: Any) -> None:
    env = RolesParallelEnv(TOY)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="must be a dictionary with an action for each agent"):
        env.step(actions)


@pytest.mark.parametrize("steps", [0, -1e15, float("nan"), float("inf"), 5e-324, True, 1.7, "3"])
def test_a_limit_of_steps_is_a_whole_number(steps: Any) -> None:
    with pytest.raises(ConfigurationError, match=r"max_episode_steps = .* must be a whole number, at least 1"):
        ToyAttackVectorEnv(2, max_episode_steps=steps)


def test_a_refused_seed_leaves_nothing_half_started() -> None:
    envs = ToyAttackVectorEnv(2)
    with pytest.raises(error.Error, match="Seed must be greater or equal to zero"):
        envs.reset(seed=[1, -1])
    with pytest.raises(ResetNeeded):
        envs.step(np.zeros(2, np.int64))
    for seed in (1.0, "1", {}, True):
        with pytest.raises(ValueError, match="must be a whole number, one for each environment, or None"):
            envs.reset(seed=seed)  # type: ignore[arg-type]
    same = ToyAttackVectorEnv(2)
    np.testing.assert_array_equal(envs.reset(seed=[3, 4])[0], same.reset(seed=3)[0])


def test_opponents_by_preset_name_and_object() -> None:
    assert ToyAttackEnv(preset="paper").opponent == "tests.core.toy_policies:Chase"
    assert ToyAttackEnv().opponent == ToyAttackEnv(preset="learning").opponent == "cps_envs.core.policies.policy:Idle"
    chase = Chase(ToyGame(ToyConfig(), 1).spec("defender"))
    one, two = ToyAttackEnv(opponent=chase), ToyAttackEnv(opponent="tests.core.toy_policies:Chase")
    one.reset(seed=4)
    two.reset(seed=4)
    np.testing.assert_array_equal(one.step(1)[0], two.step(1)[0])


def test_a_batch_steps_only_when_all_environments_run() -> None:
    batch = ToyAttackVectorEnv(2, autoreset=AutoresetMode.DISABLED)
    with pytest.raises(ResetNeeded, match="reset"):
        batch.step([0, 0])
    with pytest.raises(ResetNeeded, match="first reset"):
        batch.reset(options={"reset_mask": np.array([True, False])})
    batch.reset(seed=0)
    batch._ended[1] = True
    with pytest.raises(ResetNeeded, match=r"environments \[1\] have ended"):
        batch.step([0, 0])


def test_missing_actions_name_the_agents() -> None:
    env, swarm = RolesParallelEnv(TOY), SwarmEnv(TOY, "defender")
    env.reset(seed=0)
    swarm.reset(seed=0)
    with pytest.raises(ValueError, match="1 actions are missing: defender_0"):
        env.step({"attacker_0": 0})
    with pytest.raises(ValueError, match="1 actions are missing: axis_1"):
        swarm.step({"axis_0": np.zeros(1)})


def test_masks_exist_for_discrete_roles_only() -> None:
    attack, defense = ToyAttackEnv(), ToyDefenseEnv()
    attack.reset(seed=0)
    assert attack.action_masks().dtype == np.bool_
    assert not hasattr(defense, "action_masks")
    with pytest.raises(AttributeError, match="the defender of 'toy' has no action masks"):
        defense.action_masks()


def test_what_a_game_does_not_offer_is_said() -> None:
    game = ToyGame(ToyConfig(), 1)
    with pytest.raises(TypeError, match="no decentralised form"):
        game.team("attacker")
    with pytest.raises(TypeError, match="no viewer"):
        Game.scene(game, 0)
    with pytest.raises(TypeError, match="abstract"):
        AnalyticPolicy(game.spec("defender"))  # type: ignore[abstract]


def test_idle_plays_neutral_for_every_environment() -> None:
    idle = Idle(ToyGame(ToyConfig(), 1).spec("defender"))
    assert isinstance(idle, Policy)
    assert idle.predict(np.zeros((3, 5)))[0].tolist() == [[0, 0]] * 3


def test_a_spec_tells_what_a_policy_may_know() -> None:
    spec = ToyGame(ToyConfig(), 1).spec("attacker")
    assert (spec.problem, spec.role, spec.decision_interval_s, spec.config) == ("toy", "attacker", 3.0, ToyConfig())


def test_environment_metrics_are_plain_numbers() -> None:
    env = ToyAttackEnv()
    _, info = env.reset(seed=0)
    assert {type(info[name]) for name in ("closeness", "fee", "distance_m")} == {float}


def test_environments_without_a_seed_start_too() -> None:
    envs = ToyAttackVectorEnv(3)
    envs.reset()
    assert len(envs.step(envs.action_space.sample())[1]) == 3
    envs.reset(seed=[None, 4, None])
    alone = ToyAttackEnv()
    np.testing.assert_array_equal(envs.game.observe("attacker")[1], alone.reset(seed=4)[0])


def test_an_ended_environment_starts_again_in_the_next_step() -> None:
    envs = ToyAttackVectorEnv(2)
    envs.reset(seed=0)
    still = np.zeros_like(envs.action_space.sample())
    for _ in range(envs.game.horizon):
        _, _, terminated, truncated, _ = envs.step(still)
        ended = terminated | truncated
        if ended.any():
            break
    assert envs.game.elapsed[ended].all()
    _, rewards, terminated, truncated, _ = envs.step(still)
    assert not envs.game.elapsed[ended].any()
    assert not rewards[ended].any()
    assert not (terminated | truncated)[ended].any()


def test_actions_that_are_no_numbers_are_refused() -> None:
    env = ToyAttackVectorEnv(2)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="rows of one length were expected"):
        env.step([[0.0], [0.0, 1.0]])
