"""The parts of a follower as a learner's actions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, FloatArray
from cps_envs.disbanding.follower import LEADERS, OTHERS, SetPoints
from cps_envs.disbanding.parts import LEVELS, NEUTRAL, PartsRoad, points_of
from cps_envs.disbanding.problem import DISBANDING
from tests.disbanding.rounds import game_of, played, started_match
from tests.episodes import seen_by

ALWAYS = "always?adapter=parts_road"


def test_neutral_parts_are_the_platoons_own_law() -> None:
    """Bit for bit."""
    without, _ = played(defender="none", count=6)
    assert np.array_equal(played(defender=f"{ALWAYS}&action=[1,1,1,1,1]", count=6)[0], without)


@pytest.mark.slow
def test_random_parts_are_at_most_2_2_times_as_bad_as_none() -> None:
    """In whole episodes, in which an action is held as the role's page says."""
    envs = LearningVectorEnv(DISBANDING, "defender", 64, scaling=((), ()), copies=2)  # with copies all begin at time 0
    generator = np.random.default_rng(0)
    random, neutral = (
        returns(envs, lambda: generator.integers(0, 3, (64, 5))),
        returns(envs, lambda: np.full((64, 5), NEUTRAL)),
    )
    assert random.mean() >= 2.2 * neutral.mean()


def returns(envs: LearningVectorEnv, draw: Callable[[], Array]) -> FloatArray:
    """The defender's returns (B,) of one episode each."""
    envs.reset(seed=0)
    paid: FloatArray = np.sum([envs.step(draw())[1] for _ in range(envs.decisions)], axis=0)
    return paid


def test_all_parts_together_are_nearly_the_plain_follower() -> None:
    leader, other = (SetPoints(*row) for row in points_of(np.full((1, 1, 5), 2)).tolist())
    same = {"ahead_closing": 0.3, "ahead_command": pytest.approx(0.2), "law": 0.3}
    assert leader._asdict() == LEADERS._asdict() | same
    assert other._asdict() == OTHERS._asdict() | same


def test_wrong_signs_are_a_quarter_as_large() -> None:
    np.testing.assert_allclose(LEVELS[:4, 0], -LEVELS[:4, 2] / 4)
    assert (LEVELS[:4, NEUTRAL] == 0).all()


def test_corrections_follow_from_the_row_alone() -> None:
    game = game_of(5)
    started_match(game, attacker="spread").step({}, np.ones(5, np.bool_), 600)
    adapter = PartsRoad(game.spec("defender"))
    now, actions = seen_by(game, adapter), np.random.default_rng(0).integers(0, 3, (5, 1, 5))
    before, kept = now.observation.copy(), actions.copy()
    together, state = adapter.act(now, (), actions)
    assert state == ()
    assert np.array_equal(now.observation, before)
    assert np.array_equal(actions, kept)
    for b in range(5):
        alone, _ = adapter.act(Seen(now.fields, now.observation[b : b + 1]), (), actions[b : b + 1])
        assert np.array_equal(alone[0], together[b])


def test_parts_correct_vehicles_only() -> None:
    with pytest.raises(ConfigurationError, match="defense_action"):
        PartsRoad(game_of(1, defense_action="platoon").spec("defender"))
