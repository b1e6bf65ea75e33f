"""Several agents in B episodes at once: steps, what is due, resets, pay, and what critics see."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv, RolesVectorEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv, SwarmVectorEnv
from tests.core.learned_toy import LEARNED
from tests.core.toy import TOY

QUIET: dict[str, Any] = {"reach_m": 0.0}  # nobody is caught


def nothing(env: Any) -> dict[str, Any]:
    """The neutral action of every agent."""
    count = getattr(env, "num_envs", None)
    alone = {agent: env.neutral_action(agent) for agent in env.possible_agents}
    return alone if count is None else {agent: np.stack([action] * count) for agent, action in alone.items()}


def played(env: Any, steps: int) -> list[tuple[Any, ...]]:
    return [env.reset(seed=0), *(env.step(nothing(env)) for _ in range(steps))]


def test_a_step_lasts_until_the_first_agent_decides_again() -> None:
    env = RolesParallelEnv(LEARNED, **QUIET)
    assert env.interval == 2  # game steps: the attacker holds for 6, the defender for 4
    due = [{agent: info["due"] for agent, info in result[-1].items()} for result in played(env, 7)]
    assert [each["attacker_0"] for each in due] == [True, False, False] * 2 + [True, False]
    assert [each["defender_axis_0"] for each in due] == [True, False] * 4
    assert env.game.elapsed.tolist() == [14]


def test_the_last_step_ends_with_the_episode() -> None:
    env = RolesParallelEnv(LEARNED, **QUIET)
    *_, terminated, truncated, _ = played(env, 8)[-1]
    assert env.game.elapsed.tolist() == [15]  # in the middle of a held action of either role
    assert set(terminated.values()) == {True}
    assert set(truncated.values()) == {False}
    assert env.agents == []


def test_an_action_that_is_read_within_a_step_is_due_at_its_start() -> None:
    env = RolesParallelEnv(TOY, interface="native", frame_skip=2, **QUIET)  # the attacker decides every third step
    due = [result[-1]["attacker_0"]["due"] for result in played(env, 5)]
    assert due == [True, True, False, True, True, False]  # at 0, 3, nothing in 4 and 5, 6, 9, nothing


def test_agents_of_a_team_are_named_after_their_role() -> None:
    env = RolesParallelEnv(LEARNED)
    assert env.agents_of == {"attacker": ("attacker_0",), "defender": ("defender_axis_0", "defender_axis_1")}
    assert SwarmEnv(LEARNED, "defender").possible_agents == ["axis_0", "axis_1"]


def test_pay_is_each_agent_s_own_or_shared() -> None:
    own, shared = (played(SwarmEnv(LEARNED, "defender", shared_pay=each, **QUIET), 2) for each in (False, True))
    for one, two in zip(own[1:], shared[1:], strict=True):
        assert two[1]["axis_0"] == two[1]["axis_1"] == pytest.approx(sum(one[1].values()))


def test_only_marked_episodes_start_again_and_get_new_seeds() -> None:
    one, two = (RolesVectorEnv(LEARNED, 3, autoreset="disabled", **QUIET) for _ in range(2))
    played(one, 3), played(two, 3)
    mask = np.array([False, True, False])
    shown, _ = one.reset(seed=9, options={"reset_mask": mask})
    assert one.game.elapsed.tolist() == [6, 0, 6]
    alone = RolesParallelEnv(LEARNED, **QUIET).reset(seed=10)[0]
    np.testing.assert_array_equal(shown["attacker_0"][1], alone["attacker_0"])
    np.testing.assert_array_equal(one.reset()[0]["attacker_0"][[0, 2]], two.reset()[0]["attacker_0"][[0, 2]])


@pytest.mark.parametrize("mask", [[True, False], np.array([1, 0]), np.array([True]), np.zeros(2, np.bool_)], ids=str)
def test_a_mask_is_a_boolean_array(mask: Any) -> None:
    env = RolesVectorEnv(LEARNED, 2)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="reset_mask"):
        env.reset(options={"reset_mask": mask})


def test_the_first_reset_starts_all() -> None:
    env = RolesVectorEnv(LEARNED, 2)
    with pytest.raises(ResetNeeded):
        env.step(nothing(env))
    with pytest.raises(ResetNeeded, match="leave out the reset_mask"):
        env.reset(options={"reset_mask": np.array([True, False])})


def test_ended_episodes_wait_where_nothing_resets_them() -> None:
    env = SwarmVectorEnv(LEARNED, "defender", 2, autoreset="disabled", **QUIET)
    played(env, 4)
    with pytest.raises(ResetNeeded, match=r"episodes \[0, 1\] have ended"):
        env.step(nothing(env))


def test_the_last_metrics_are_those_of_the_episode_that_has_ended() -> None:
    env = RolesVectorEnv(LEARNED, 2, **QUIET)
    *_, infos = played(env, 8)[-1]
    assert infos["_final_obs"].all()
    assert infos["final_info"]["closeness"].min() > 1.0
    assert infos["closeness"].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("problem", [TOY, LEARNED])
def test_critics_see_all_roles(problem: Any) -> None:
    single, batch = RolesParallelEnv(problem), RolesVectorEnv(problem, 2)
    single.reset(seed=0)
    batch.reset(seed=0)
    assert single.state_space.contains(single.state())
    np.testing.assert_array_equal(batch.state()[0], single.state())


def test_max_cycles_truncates_a_batch_as_it_does_one() -> None:
    env = RolesVectorEnv(LEARNED, 2, max_cycles=2, autoreset="next_step", **QUIET)
    truncated = [result[3]["attacker_0"].tolist() for result in played(env, 5)[1:]]
    assert truncated == [[False, False], [True, True], [False, False], [False, False], [True, True]]


@pytest.mark.parametrize("seed", [1.5, True, [1], "one"], ids=str)
def test_seeds_are_whole_numbers(seed: Any) -> None:
    with pytest.raises(ValueError, match="seed"):
        RolesVectorEnv(LEARNED, 2).reset(seed=seed)


def test_adapters_are_named_by_role() -> None:
    env = RolesParallelEnv(LEARNED, adapters={"defender": "native"})
    assert env.possible_agents == ["attacker_0", "defender_0"]
    with pytest.raises(ConfigurationError, match="adapters names 'guard', which is no role"):
        RolesParallelEnv(LEARNED, adapters={"guard": "axis"})  # type: ignore[dict-item]


def test_who_decides_now_changes_nothing_of_episodes_in_which_nobody_does() -> None:
    batch, alone = RolesVectorEnv(LEARNED, 2, autoreset="disabled", **QUIET), RolesParallelEnv(LEARNED, **QUIET)
    batch.reset(seed=0)
    alone.reset(seed=0)
    for step in range(6):
        if step == 1:
            batch.reset(options={"reset_mask": np.array([False, True])})  # out of phase from here on
        actions = {agent: np.full_like(action, 1) for agent, action in nothing(batch).items()}
        shown = batch.step(actions)[0]
        expected = alone.step({agent: action[0] for agent, action in actions.items()})[0]
        for agent, seen in expected.items():
            np.testing.assert_array_equal(shown[agent][0], seen)
