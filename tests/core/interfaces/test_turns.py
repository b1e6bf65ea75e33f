"""Both roles in turns: what is wrong is refused in the turn in which it is wrong, and changes nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from cps_envs.core.errors import UnknownNameError
from cps_envs.core.interfaces.aec_env import RolesAECEnv
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv, RolesVectorEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv, SwarmVectorEnv
from tests.core.learned_toy import LEARNED
from tests.core.toy import TOY, ToyAttackEnv

PUSH = np.array([0.5, -0.5])


def turns() -> RolesAECEnv:
    return RolesAECEnv(RolesParallelEnv(TOY, reach_m=0.0))


def test_nothing_is_told_or_done_before_the_first_reset() -> None:
    env = turns()
    assert env.agents == []
    for call in (lambda: env.step(0), env.last, lambda: env.observe("attacker_0"), env.state, env.render):
        with pytest.raises(ResetNeeded, match=r"call reset\(\) first"):
            call()


def test_a_wrong_action_is_refused_in_its_turn_and_another_may_follow() -> None:
    env, beside = turns(), RolesParallelEnv(TOY, reach_m=0.0)
    env.reset(seed=3)
    beside.reset(seed=3)
    for _ in range(4):
        for wrong in (7, None, "up", [0, 1]):
            with pytest.raises(ValueError, match=r"expected|whole number"):
                env.step(wrong)
            assert env.agent_selection == "attacker_0"
        env.step(1)
        with pytest.raises(ValueError, match=r"an action of shape \(2,\)"):
            env.step(1)
        assert env.agent_selection == "defender_0"
        env.step(PUSH)
        seen, paid, *_ = beside.step({"attacker_0": 1, "defender_0": PUSH})
        for agent in env.agents:
            np.testing.assert_array_equal(env.observe(agent), seen[agent])
            assert env.rewards[agent] == paid[agent]


def test_ended_agents_take_no_action_and_then_a_reset_is_needed() -> None:
    env = turns()
    env.reset(seed=0)
    for _ in range(12):
        env.step(0), env.step(PUSH)
    assert env.last()[2]
    for _ in range(2):
        with pytest.raises(ValueError, match=r"action = 0: the episode of .*_0 has ended, so its action is None"):
            env.step(0)
        env.step(None)
    for call in (lambda: env.step(None), env.last):
        with pytest.raises(ResetNeeded, match=r"no episode is running: call reset\(\) first"):
            call()
    env.reset()
    assert env.agents == ["attacker_0", "defender_0"]


@pytest.mark.parametrize(
    "env",
    [turns(), RolesParallelEnv(LEARNED), RolesVectorEnv(TOY, 2), SwarmEnv(TOY, "defender")],
    ids=lambda env: type(env).__name__,
)
def test_there_are_no_other_agents(env: Any) -> None:
    env.reset(seed=0)
    for name in ("observation_space", "action_space"):
        with pytest.raises(UnknownNameError, match=r"there is no agent 'attaker_0' here\. "):
            getattr(env, name)("attaker_0")
        with pytest.raises(UnknownNameError, match="there is no agent 3 here"):
            getattr(env, name)(3)
    if env.__class__ is RolesAECEnv:
        with pytest.raises(UnknownNameError, match=r"no agent 'attaker_0' here\. Did you mean 'attacker_0'"):
            env.observe("attaker_0")
        return
    actions = {agent: env.neutral_action(agent) for agent in env.possible_agents}
    with pytest.raises(ValueError, match=r"there is no agent 'attaker_0' to act\. "):
        env.step({**actions, "attaker_0": 0})


@pytest.mark.parametrize("seed", [-1, 1.5, "one", True, [1], np.float64(2.0)], ids=repr)
def test_a_seed_of_one_episode_is_a_whole_number(seed: Any) -> None:
    for env in (ToyAttackEnv(), RolesParallelEnv(TOY), SwarmEnv(TOY, "defender"), turns()):
        with pytest.raises(ValueError, match=r"seed = .* must be a whole number from 0 on, or None"):
            env.reset(seed=seed)
    equal = [ToyAttackEnv().reset(seed=each)[0] for each in (4, np.int64(4))]
    np.testing.assert_array_equal(*equal)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"options": {"staggered": "no"}}, "staggered = 'no' must be True or False"),
        ({"options": {"start": 1.5}}, "start = 1.5 must be a whole number from 0 on"),
        ({"seed": [3, 7]}, r"seed = \[3, 7\] must be a whole number from 0 on"),
        ({"seed": 1, "options": {"reset_mask": np.ones(2, np.bool_)}}, "seed is for all episodes of a run"),
        ({"options": {"start": 1, "reset_mask": np.ones(2, np.bool_)}}, "start is for all .*: leave one of them out"),
        ({"options": {"staggered": True, "reset_mask": np.ones(2, np.bool_)}}, "staggered is for all episodes"),
    ],
    ids=str,
)
def test_what_a_training_environment_cannot_obey_is_refused_and_changes_nothing(given: Any, message: str) -> None:
    one, two = (LearningVectorEnv(LEARNED, "attacker", 2, seed=5, scaling=((), ())) for _ in range(2))
    for env in (one, two):
        env.reset()
    with pytest.raises(ValueError, match=message):
        one.reset(**given)
    for action in (np.array([1, 2]), np.array([0, 4])):
        np.testing.assert_array_equal(one.step(action)[0], two.step(action)[0])
    np.testing.assert_array_equal(one.reset(seed=[6])[0], two.reset(seed=6)[0])


def test_every_form_unwraps_to_what_configures() -> None:
    for env in (RolesVectorEnv(TOY, 2), SwarmVectorEnv(TOY, "defender", 2)):
        assert env.unwrapped is env
    whole = turns()
    whole.unwrapped.configure(drift=0.3)
    assert whole.unwrapped.config.drift == 0.3
