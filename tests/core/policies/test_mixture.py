"""Opponents drawn from several: shares, environments stay independent, states of every kind, and what is refused."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils import seeding

from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.policies.mixture import Mixture, StateBlock, _gather
from cps_envs.core.types import Array
from tests.core.toy import TOY

MEMBERS = ("cps_envs.core.policies.policy:Idle", "tests.core.toy_policies:Approach", "tests.core.toy_policies:Wander")


def mixture(policies: Any = MEMBERS, weights: Any = None, num_envs: int = 1) -> Mixture:
    return Mixture(TOY.game(TOY.config("paper", {}), num_envs).spec("attacker"), policies, weights)


def play(opponent: Mixture | str, num_envs: int, seed: int, steps: int = 40) -> Array:
    """Observations of a batch in which the mixture attacks, across several episodes."""
    envs = gymnasium.make_vec("toys/ToyDefense-v0", num_envs=num_envs, opponent=opponent)
    still = np.zeros(envs.action_space.shape, np.float32)
    return np.array([envs.reset(seed=seed)[0], *(envs.step(still)[0] for _ in range(steps))])


@pytest.mark.parametrize("member", MEMBERS)
def test_a_mixture_of_one_is_that_one(member: str) -> None:
    whole, alone = play(mixture((member,)), 3, 7, 10), play(member, 3, 7, 10)
    if "Wander" in member:  # the draw of the member comes first
        assert whole.shape == alone.shape
    else:
        np.testing.assert_array_equal(whole, alone)


def test_environments_are_independent() -> None:
    batch = play(mixture(), 6, 11)
    for b in range(6):
        np.testing.assert_array_equal(batch[:, b], play(mixture(), 1, 11 + b)[:, 0])


def test_weights_are_the_shares_of_the_episodes() -> None:
    player = mixture(MEMBERS, [1, 0, 3])
    drawn, *_ = player.begin([seeding.np_random(seed)[0] for seed in range(2000)], [{}] * 2000)
    shares = np.bincount(drawn, minlength=3) / 2000
    np.testing.assert_allclose(shares, [0.25, 0, 0.75], atol=0.04)


def test_by_name() -> None:
    options = 'policies=["tests.core.toy_policies:Approach","cps_envs.core.policies.policy:Idle"]&weights=[1,2]'
    assert play(f"cps_envs.core.policies.mixture:Mixture?{options}", 2, 0, 5).shape[1] == 2


@pytest.mark.parametrize("policies", ["none", 3, [], {}])
def test_policies_that_are_no_list_are_refused(policies: Any) -> None:
    with pytest.raises(ConfigurationError, match="a mixture needs policies, such as"):
        mixture(policies=policies)


@pytest.mark.parametrize(
    "weights", [["a"] * 3, [[1], [1, 2], 3], 3, [1], [1, -1, 1], [0, 0, 0], [np.nan, 1, 1], [np.inf, 1, 1]]
)
def test_weights_that_do_not_fit_are_refused(weights: Any) -> None:
    with pytest.raises(ConfigurationError, match="weights"):
        mixture(weights=weights)


def test_an_empty_mixture_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="needs policies"):
        mixture(())


def test_unknown_members_are_refused() -> None:
    with pytest.raises(UnknownNameError):
        mixture(("nobody",))


def test_probabilities_are_the_weights_in_shares() -> None:
    np.testing.assert_array_equal(mixture(MEMBERS, [1, 0, 3]).probabilities, [0.25, 0, 0.75])


def test_states_are_put_together_row_by_row() -> None:
    one, other = StateBlock(2, (np.array([10, 20]),)), StateBlock(2, (np.array([30, 40]),))

    def blocks(*found: Any) -> Any:
        array = np.empty(len(found), object)
        array[:] = found
        return array

    gathered = [
        _gather(np.array(rows), blocks(*found))[0].tolist()
        for rows, found in (([0, 1], (one, one)), ([1, 0], (one, one)), ([0, 1], (one, other)), ([1], (one,)))
    ]
    assert gathered == [[10, 20], [20, 10], [10, 40], [20]]
    assert _gather(np.array([0, 1]), blocks(StateBlock(2, None), one))[0].tolist() == [0, 20]
    longer = StateBlock(2, (np.array([50, 60]), np.array([70, 80])))
    with pytest.raises(ValueError, match="zip"):  # a policy that changes how many arrays it remembers is not cut short
        _gather(np.array([0, 1]), blocks(one, longer))
    three = StateBlock(3, (np.array([10, 20, 30]),))
    assert _gather(np.array([0, 1]), blocks(three, three))[0].tolist() == [10, 20]


def test_what_was_returned_last_is_used_only_while_it_is_handed_back() -> None:
    """Others than the last ones, as after a restart or in a second match, are gathered from the state itself."""
    player = mixture(("tests.core.toy_policies:Wander", "tests.core.toy_policies:Approach"))
    observation = np.zeros((6, player.spec.fields.size), np.float32)

    def begin(first: int) -> Any:
        return player.begin([seeding.np_random(first + b)[0] for b in range(6)], [{}] * 6)

    def go_on(state: Any, times: int) -> list[Array]:
        played = []
        for _ in range(times):
            actions, state = player.predict(observation, state)
            played.append(actions)
        return played

    alone = [go_on(begin(first), 4) for first in (0, 100)]
    mixed: tuple[list[Array], list[Array]]
    states, mixed = [begin(0), begin(100)], ([], [])
    for _ in range(4):
        for which in (0, 1):
            actions, states[which] = player.predict(observation, states[which])
            mixed[which].append(actions)
    np.testing.assert_array_equal(alone, mixed)
