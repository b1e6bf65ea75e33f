"""MultiDiscrete actions as Discrete ones."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec

import cps_envs
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.interfaces.discrete import DiscreteActions

IDS = [problem.discrete_id(role) for problem in cps_envs.PROBLEMS.values() for role in problem.discrete]


def make(env_id: str) -> Any:
    return gymnasium.make(env_id, preset="learning")


def test_every_role_with_several_choices_at_once_has_an_id_of_this_kind() -> None:
    for problem in cps_envs.PROBLEMS.values():
        for role in ("attacker", "defender"):
            space = gymnasium.make(problem.env_id(role)).action_space
            assert isinstance(space, spaces.MultiDiscrete) == (role in problem.discrete)


@pytest.mark.parametrize("env_id", IDS)
def test_one_entry_changes_in_a_step_and_the_others_are_held(env_id: str) -> None:
    env = make(env_id)
    assert isinstance(env.action_space, spaces.Discrete)
    env.reset(seed=0)
    wrapper: Any = env.unwrapped
    while not isinstance(env, DiscreteActions):
        env = env.env
    neutral = wrapper.game.neutral_action[wrapper.role]
    assert (env.action(0) == neutral).all()
    sizes = wrapper.action_space.nvec
    for number in range(1, env.action_space.n):
        before, after = env.action(0), env.action(number)
        entry = int(np.searchsorted(np.cumsum(sizes), number - 1, side="right"))
        assert after[entry] == number - 1 - sizes[:entry].sum()
        assert (np.delete(after, entry) == np.delete(before, entry)).all()


@pytest.mark.parametrize("env_id", IDS)
def test_legal_actions_stay_legal(env_id: str) -> None:
    env = make(env_id)
    env.action_space.seed(1)
    _, info = env.reset(seed=0)
    for _ in range(60):
        mask = info.get("action_mask")
        if mask is not None:
            assert mask.shape == (env.action_space.n,)
            assert mask[0] == 1
            assert (env.get_wrapper_attr("action_masks")() == mask.astype(bool)).all()
        _, _, terminated, truncated, info = env.step(env.action_space.sample(mask))
        if terminated or truncated:
            _, info = env.reset()


def test_a_new_episode_begins_with_the_neutral_action() -> None:
    env = make("cps_envs/RogueDefenseDiscrete-v0")
    env.reset(seed=0)
    env.step(2)
    env.reset(seed=0)
    world: Any = env.unwrapped
    assert (env.get_wrapper_attr("action")(0) == world.game.neutral_action["defender"]).all()


def test_what_it_refuses() -> None:
    env = make("cps_envs/RogueDefenseDiscrete-v0")
    env.reset(seed=0)
    for action in (-1, env.action_space.n, 0.5, [1, 2]):
        with pytest.raises(ValueError, match="must be a whole number from 0 to"):
            env.get_wrapper_attr("action")(action)
    with pytest.raises(ConfigurationError, match="only MultiDiscrete actions can be made Discrete"):
        DiscreteActions(gymnasium.make("cps_envs/HvacAttack-v0"))


@pytest.mark.parametrize("env_id", IDS)
def test_its_specification_travels(env_id: str) -> None:
    spec = gymnasium.make(env_id, preset="learning").spec
    assert spec is not None
    again = gymnasium.make(EnvSpec.from_json(spec.to_json()))
    assert isinstance(again.action_space, spaces.Discrete)
