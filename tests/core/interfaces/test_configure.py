"""What is set is obeyed or refused: `configure`, options of `reset`, and attributes that are read-only."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import cps_envs
from cps_envs.core.errors import ConfigurationError, UnknownOptionError
from cps_envs.core.interfaces.learning_env import LearningVectorEnv
from cps_envs.core.interfaces.parallel_env import RolesParallelEnv, RolesVectorEnv
from cps_envs.core.interfaces.swarm_env import SwarmEnv, SwarmVectorEnv
from tests.core.interfaces.test_agents_batch import nothing
from tests.core.learned_toy import LEARNED
from tests.core.toy import TOY, ToyAttackEnv, ToyAttackVectorEnv
from tests.core.toy_policies import Chase

FORMS: dict[str, Callable[..., Any]] = {
    "single": ToyAttackEnv,
    "vector": lambda **options: ToyAttackVectorEnv(3, **options),
    "parallel": lambda **options: RolesParallelEnv(TOY, **options),
    "parallel vector": lambda **options: RolesVectorEnv(TOY, 3, **options),
    "swarm": lambda **options: SwarmEnv(TOY, "defender", **options),
    "swarm vector": lambda **options: SwarmVectorEnv(TOY, "defender", 3, **options),
    "learning": lambda **options: LearningVectorEnv(LEARNED, "attacker", 3, **options),
}


def course(env: Any, steps: int = 3, **options: Any) -> list[Any]:
    """What follows from a reset and neutral actions, in a form that can be compared."""
    found = [env.reset(seed=4, **options)]
    for _ in range(steps):
        agents = hasattr(env, "possible_agents")
        action = nothing(env) if agents else np.zeros(getattr(env, "num_envs", ()), np.int64)
        found.append(env.step(action))
    return [repr(each) for each in found]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("fields", [{"intruder_speed": 1.5}, {"drift": 0.4, "intruder_speed": (1.0, 1.5)}], ids=str)
def test_from_the_next_reset_on_an_environment_plays_what_configure_says(form: str, fields: dict[str, Any]) -> None:
    scaled = form == "learning"  # inputs of another configuration are measured anew, those of this one are kept
    made = FORMS[form](**fields, **({"scaling": ((0.0,) * 15, (1.0,) * 15)} if scaled else {}))
    env = FORMS[form](**({"scaling": ((0.0,) * 15, (1.0,) * 15)} if scaled else {}))
    before = course(env)
    env.configure(**fields)
    assert env.config == made.config
    assert course(env) == course(made) != before
    assert course(env) == course(made)  # and goes on with it


@pytest.mark.parametrize("form", FORMS)
def test_options_of_reset_count_once(form: str) -> None:
    env = FORMS[form]()
    plain = course(env)
    asked = course(env, options={"intruder_speed": 1.5})
    assert env.config.intruder_speed == (0.3, 0.9)
    assert course(env) == plain != asked
    speeds = (env.reset(seed=1, options={"intruder_speed": (1.2, 1.4)}), env.game.speed)[1]
    assert ((speeds >= 1.2) & (speeds <= 1.4)).all()


def test_options_of_reset_are_for_the_marked_episodes() -> None:
    env = ToyAttackVectorEnv(3)
    env.reset(seed=0)
    others = env.game.speed.copy()
    env.reset(options={"reset_mask": np.array([False, True, False]), "intruder_speed": 2.0})
    assert env.game.speed.tolist() == [others[0], 2.0, others[2]]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"drift": 0.1},
            r"the option drift of reset: drift changes by configure\(drift=0.1\) only",
        ),
        ({"opponent": "none"}, r"opponent changes by configure\(opponent=...\) only"),
        ({"frame_skip": 2}, "frame_skip is settled when an environment is made"),
        ({"intruder_sped": 1.0}, "unknown, and changes nothing. Did you mean 'intruder_speed'"),
        ({"intruder_speed": 9.0}, r"intruder_speed = 9.0 is outside \[0.1, 2\] m/s"),
        ({"intruder_speed": "fast"}, "must be a number or a pair"),
    ],
    ids=str,
)
def test_other_options_are_refused_and_nothing_happens(form: str, options: dict[str, Any], message: str) -> None:
    env = FORMS[form]()
    plain = course(env)
    with pytest.raises(ConfigurationError, match=message):
        env.reset(seed=1, options=options)
    assert course(env) == plain


def test_an_option_unlike_all_others_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(gymnasium.logger, "warn", said.append)
    ToyAttackEnv().reset(options={"options": 1})
    assert said == ["the option 'options' of reset is unknown, and changes nothing. Known: intruder_speed"]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("fields", "error", "message"),
    [
        ({"drif": 0.1}, UnknownOptionError, "has no field 'drif'.*Did you mean 'drift'"),
        ({"drift": -1}, ConfigurationError, "outside"),
        ({"duration_s": 30.0}, ConfigurationError, "agents would see or do something else.*make another"),
        ({"frame_skip": 2}, UnknownOptionError, "no field 'frame_skip'"),
    ],
    ids=str,
)
def test_what_cannot_be_configured_is_refused_and_nothing_happens(
    form: str, fields: dict[str, Any], error: type[Exception], message: str
) -> None:
    env = FORMS[form]()
    plain, config = course(env), env.config
    with pytest.raises(error, match=message):
        env.configure(**fields)
    assert course(env) == plain
    assert env.config is config


@pytest.mark.parametrize("form", FORMS)
def test_what_an_environment_was_made_with_is_read_only(form: str) -> None:
    env = FORMS[form]()
    for name, message in (
        ("config", r"config changes by configure\(FIELD=value\) only"),
        ("opponent", r"opponent changes by configure\(opponent=...\) only"),
        ("intruder_speed", r"intruder_speed changes by configure\(intruder_speed=1.0\) only"),
        ("frame_skip", "settled when an environment is made"),
        ("preset", "settled"),
        ("game", "settled"),
        ("num_envs", "settled"),
        ("pay_power", "settled"),
    ):
        with pytest.raises(AttributeError, match=message):
            setattr(env, name, 1.0)
    with pytest.raises(AttributeError, match="read-only: build another game"):
        env.game.config = None
    env.of_my_own = 1  # anybody may keep things here


def test_a_running_episode_goes_on_as_it_began() -> None:
    env, other = ToyAttackEnv(), ToyAttackEnv()
    course(env, 2)
    course(other, 2)
    env.configure(drift=0.5, intruder_speed=2.0, opponent=Chase(TOY.game(env.config, 1).spec("defender")))
    assert repr(env.step(1)) == repr(other.step(1))
    env.reset()
    assert env.game.config.drift == 0.5
    assert env.game.speed == 2.0


@pytest.mark.parametrize("mode", ["same_step", "next_step", "disabled"])
def test_a_batch_truncates_what_runs_and_starts_anew(mode: str) -> None:
    env = ToyAttackVectorEnv(3, autoreset=mode)
    env.reset(seed=0)
    before = env.game
    env.configure(drift=0.5)
    _, _, terminated, truncated, infos = env.step(np.zeros(3, np.int64))
    assert truncated.all()
    assert not terminated.any()
    if mode == "same_step":
        assert infos["_final_obs"].all()
        assert infos["final_info"]["_closeness"].all()
    elif mode == "next_step":
        assert env.game is before
        assert not env.step(np.zeros(3, np.int64))[3].any()
    else:
        with pytest.raises(ResetNeeded, match="has to start every environment"):
            env.reset(options={"reset_mask": np.array([True, False, False])})
        env.reset(options={"reset_mask": np.ones(3, np.bool_)})
    assert env.game.config.drift == 0.5
    assert env.game is not before
    assert not env.step(np.zeros(3, np.int64))[3].any()


def test_a_batch_changes_ranges_as_episodes_start() -> None:
    env = ToyAttackVectorEnv(2, autoreset="same_step", reach_m=0.0, max_episode_steps=2)
    env.reset(seed=0)
    game, slow = env.game, env.game.speed.copy()
    env.configure(intruder_speed=2.0)
    assert not env.step(np.zeros(2, np.int64))[3].any()
    assert (env.game.speed == slow).all()
    assert env.step(np.zeros(2, np.int64))[3].all()  # the clock
    assert env.game is game
    assert env.game.speed.tolist() == [2.0, 2.0]


def test_an_opponent_can_be_changed() -> None:
    env = ToyAttackVectorEnv(2, opponent="none")
    env.configure(opponent="always?action=[1,1]")
    made = ToyAttackVectorEnv(2, opponent="always?action=[1,1]")
    assert course(env) == course(made)
    assert env.opponent == made.opponent


def test_training_goes_on_with_other_episodes_and_the_same_scale_of_inputs() -> None:
    env = LearningVectorEnv(LEARNED, "attacker", 16, duration_s=60.0)
    space = env.single_observation_space
    env.reset()
    env.configure(drift=0.5)
    env.step(np.zeros(16, np.int64))
    assert env.game.config.drift == 0.5
    assert len(set(env.game.elapsed.tolist())) > 1  # staggered anew
    assert env.wired.wiring == space.wiring  # type: ignore[attr-defined]


def test_a_changed_environment_can_be_pickled() -> None:
    env = ToyAttackEnv()
    env.configure(intruder_speed=1.5, drift=0.2)
    copy = pickle.loads(pickle.dumps(env))
    assert course(copy) == course(env)
    with pytest.raises(AttributeError, match="only, from the next reset on"):
        copy.config = None


DRAWN = {
    "rogue": ("power_ratio", 2.5),
    "disbanding": ("tau_s", 0.3),
    "fdi": ("onset_s", 2.0),
    "hvac": ("onset_step", 300),
}


@pytest.mark.parametrize("name", DRAWN)
def test_episodes_of_the_problems_draw_what_reset_asks_for(name: str) -> None:
    problem = cps_envs.PROBLEMS[name]
    field, value = DRAWN[name]
    envs = gymnasium.make_vec(problem.env_id("defender"), 2, "vector_entry_point", interface="native")
    game: Any = envs.unwrapped.game  # type: ignore[attr-defined]
    envs.reset(seed=0, options={field: value})
    found = {
        "rogue": lambda: game.drawn["attacker_drive_mps2"] / game.drawn["drive_mps2"],
        "disbanding": lambda: game.constants["tau_s"],
        "fdi": lambda: game.state.onset[game.state.onset < game.horizon] * game.step_s,
        "hvac": lambda: game.state.onset,
    }[name]()
    assert found == pytest.approx(value)


def test_a_number_of_liars_is_drawn_though_the_preset_weighs_it() -> None:
    envs = gymnasium.make_vec("cps_envs/HvacDefense-v0", 8, "vector_entry_point", interface="native")
    game: Any = envs.unwrapped.game  # type: ignore[attr-defined]
    envs.reset(seed=0, options={"num_compromised": 2})
    assert game.state.compromised.sum(axis=1).tolist() == [2] * 8
    envs.reset(seed=0)
    assert len(set(game.state.compromised.sum(axis=1).tolist())) > 1


def test_values_that_arrays_are_not_made_for_are_refused() -> None:
    env = gymnasium.make("cps_envs/RogueDefense-v0", interface="native")
    with pytest.raises(ConfigurationError, match=r"num_vehicles = 9: .* made for .*\(4, 8\). Make one with .*\(4, 9\)"):
        env.reset(options={"num_vehicles": 9})
    env.reset(seed=0, options={"num_vehicles": 5, "attacker_index": 2})
    assert env.unwrapped.game.truth(0)["seat"] == 1  # type: ignore[attr-defined]


@pytest.mark.parametrize("form", FORMS)
def test_nothing_is_told_of_episodes_before_the_first_reset(form: str) -> None:
    env = FORMS[form]()
    asked = [ask for ask in ("action_masks", "active", "privileged", "state") if hasattr(env, ask)]
    assert asked
    for ask in asked:
        with pytest.raises(ResetNeeded, match=r"no episode has begun: call reset\(\) first"):
            getattr(env, ask)()
    env.reset(seed=0)
    assert all(len(getattr(env, ask)()) for ask in asked)


def test_rows_that_are_scaled_otherwise_are_another_space() -> None:
    made, other = LearningVectorEnv(LEARNED, "attacker", 2), LearningVectorEnv(LEARNED, "attacker", 2, drift=0.5)
    one, another = made.single_observation_space, other.single_observation_space
    assert one == pickle.loads(pickle.dumps(one)) == LearningVectorEnv(LEARNED, "attacker", 3).single_observation_space
    assert one != another
    assert repr(one) != repr(another)
    kept = LearningVectorEnv(LEARNED, "attacker", 2, drift=0.5, scaling=one)  # type: ignore[arg-type]
    assert kept.single_observation_space == one
    assert gymnasium.spaces.Box(-5.0, 5.0, one.shape) == one  # what others make of it is as before
