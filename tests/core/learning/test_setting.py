"""What the arguments of an environment come to, and what is refused in one sentence."""

from __future__ import annotations

from typing import Any

import pytest
from gymnasium import spaces

from cps_envs.core.errors import ConfigurationError
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv
from tests.core.learned_toy import LEARNED, LearnedAttackEnv, LearnedDefenseEnv, LearnedDefenseVectorEnv
from tests.core.toy import ToyDefenseEnv


def test_learners_meet_their_interface_where_the_problem_declares_it() -> None:
    assert LearnedDefenseEnv().interface == "learning"
    assert LearnedDefenseEnv(preset="paper").interface == "native"
    native = LearnedDefenseEnv(interface="native")  # of which no setting is declared
    assert (native.frame_skip, native.action_space) == (1, ToyDefenseEnv(preset="learning").action_space)
    assert ToyDefenseEnv(preset="learning").interface == "native"
    assert RolesParallelEnv(LEARNED).interface == "learning"
    assert LearnedDefenseEnv(preset="paper", interface="learning", scaling=((), ())).frame_skip == 4


def test_settings_replace_those_of_the_declaration() -> None:
    env = LearnedDefenseEnv(frame_skip=2, recent_s=[], adapter="native", scaling=((), ()))
    wiring = env.observation_space.wiring  # type: ignore[attr-defined]
    assert (wiring.frame_skip, wiring.recent_s, wiring.adapter) == (2, (), "native")
    assert env.overrides == {}
    assert LearnedDefenseEnv(drift=0.1, scaling=((), ())).overrides == {"drift": 0.1}


@pytest.mark.parametrize("name", ["adapter", "recent_s", "rough_s", "shared_pay"])
def test_settings_for_learners_are_refused_by_the_native_interface(name: str) -> None:
    value: Any = {"adapter": "axis", "recent_s": (3.0,), "rough_s": 1.0, "shared_pay": True}[name]
    with pytest.raises(ConfigurationError, match=f'^{name} is a setting of the interface for learners.*"learning"$'):
        LearnedDefenseEnv(interface="native", **{name: value})


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"interface": "natve"}, "interface = 'natve' must be one of learning, native"),
        ({"interface": 3}, "interface = 3 must be one of"),
        ({"frame_skip": 2.5}, r"frame_skip = 2\.5 must be a whole number, at least 1"),
        ({"recent_s": (0.0,)}, "must be times in seconds"),
        ({"recent_s": 3.0}, "must be times in seconds"),
        ({"rough_s": "long"}, "must be times in seconds"),
        ({"adapter": 3}, "adapter = 3 must be a name"),
        ({"shared_pay": "yes"}, "shared_pay = 'yes' must be True or False"),
        ({"flat": True}, "flat=True is for discrete actions"),
        ({"scaling": ((0.0,), (1.0,))}, "trained with 1 scaled inputs"),
    ],
)
def test_nonsense_is_refused_in_one_sentence(kwargs: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        LearnedDefenseEnv(**{"scaling": ((), ()), **kwargs})


def test_too_many_combinations_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cps_envs.core.declare.actions.MOST_FLAT", 4)
    with pytest.raises(ConfigurationError, match=r"at most 4: .* has 5\. Leave it out, or choose another adapter"):
        LearnedAttackEnv(flat=True, scaling=((), ()))


def test_unknown_ways_of_resetting_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="autoreset = 'sometimes' must be one of same_step, next_step, disab"):
        LearnedDefenseVectorEnv(2, autoreset="sometimes")


def test_an_episode_of_many_decisions_is_said_to_be_long() -> None:
    with pytest.warns(UserWarning, match="an episode has 600 decisions here; .* raise frame_skip = 1"):
        LearnedDefenseEnv(duration_s=600.0, frame_skip=1, scaling=((), ()))


def test_a_team_is_one_agent_or_a_row_for_each() -> None:
    joint = LearnedDefenseVectorEnv(3, scaling=((), ()))
    rows = LearnedDefenseVectorEnv(3, per_agent=True, scaling=((), ()))
    assert (joint.num_envs, rows.num_envs) == (3, 6)
    assert joint.single_action_space == spaces.Box(-1.0, 1.0, (2,))
    assert rows.single_action_space == spaces.Box(-1.0, 1.0, (1,))
    assert joint.neutral_action.shape == (2,)


def test_an_opponent_of_nobody_and_another_interface_of_training_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="opponent = 'none' would play nobody: both roles are played from out"):
        RolesParallelEnv(LEARNED, opponent="none")
    with pytest.raises(ConfigurationError, match="interface = 'native' is not for training environments"):
        LearningVectorEnv(LEARNED, "attacker", 1, interface="native")
