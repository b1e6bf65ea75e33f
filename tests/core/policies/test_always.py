"""The policy that takes one action, in every problem and role."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs import PROBLEMS, find_problem
from cps_envs.core.errors import UnknownNameError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import is_decentralised
from cps_envs.core.policies.uniform import Uniform
from cps_envs.core.types import ROLES, Role
from tests.core.toy import ToyConfig, ToyGame


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("role", ROLES)
def test_neutral_action_always_is_doing_nothing(name: str, role: Role) -> None:
    problem = find_problem(name)
    config = problem.config("paper", {})
    neutral = problem.game(config, 1).neutral_action[role].tolist()
    always = resolve_policy("always", problem.game(config, 1).spec(role), action=neutral)
    idle = play_episodes(problem, config, {role: "none"}, range(2))
    same = play_episodes(problem, config, {role: always}, range(2))
    for metric, values in idle.items():
        np.testing.assert_array_equal(values, same[metric])


def test_a_number_stands_for_all_entries() -> None:
    problem = find_problem("disbanding")
    spec = problem.game(problem.config("paper", {}), 1).spec("defender")
    actions, _ = resolve_policy("always?action=0.5", spec).predict(np.zeros((3, spec.fields.size), np.float32))
    assert (actions == 0.5).all()
    assert actions.shape == (3, *spec.action_space.shape)


def test_impossible_actions_are_refused() -> None:
    problem = find_problem("hvac")
    spec = problem.game(problem.config("paper", {}), 1).spec("defender")
    with pytest.raises(ValueError, match=r"whole number inside Discrete"):
        resolve_policy("always?action=1000", spec)


def test_an_adapter_s_action_is_taken_by_all_its_agents() -> None:
    spec = ToyGame(ToyConfig(), 1).spec("defender")
    policy = resolve_policy("always?adapter=axis&action=-0.5", spec)
    assert is_decentralised(policy)
    team = np.zeros((3, 2, 2), np.float32)
    shown = np.zeros((3, spec.fields.size), np.float32)
    actions, _ = policy.predict(shown, team_observation=team)
    np.testing.assert_array_equal(actions, np.full((3, 2), -0.5))
    with pytest.raises(UnknownNameError, match="no adapter 'axes'"):
        resolve_policy("always?adapter=axes&action=0", spec)


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("role", ROLES)
def test_random_play_is_legal_and_its_own_in_each_episode(name: str, role: Role) -> None:
    problem = find_problem(name)
    config = problem.config(
        "learning", {"horizon": 30} if name == "fdi" else {"duration_s": 60.0} if name != "hvac" else {}
    )
    together = play_episodes(problem, config, {role: Uniform(problem.game(config, 1).spec(role))}, range(3))
    alone = play_episodes(problem, config, {role: Uniform(problem.game(config, 1).spec(role))}, [2])
    assert together["return"][2] == alone["return"][0]
    assert np.isfinite(together["return"]).all()
