"""stable-baselines3 on the native vector environments."""

from __future__ import annotations

import builtins
import importlib
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.conformance.actors import Crew
from cps_envs.core.declare.seeds import training_seed
from cps_envs.core.errors import ConfigurationError, MissingExtraError

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

from sb3_contrib import MaskablePPO
from sb3_contrib.common.maskable.evaluation import evaluate_policy as evaluate_maskable
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecMonitor

from cps_agents.sb3 import BatchVecEnv, as_sb3

pytestmark = pytest.mark.usefixtures("one_thread")
ATTACK, DEFENSE = "cps_envs:cps_envs/DisbandingAttack-v0", "cps_envs:cps_envs/DisbandingDefense-v0"
SMALL = {"num_platoons": 3, "vehicles_per_platoon": 3, "duration_s": 10.0, "control_period_s": 0.5}
FAST = {"n_epochs": 2, "batch_size": 256, "gamma": 0.99, "device": "cpu", "seed": 0}


def envs(env_id: str, num_envs: int = 4, **kwargs: Any) -> BatchVecEnv:
    settings = {"preset": "easy", "attack_budget": 2, "autoreset": "same_step", **SMALL, **kwargs}
    return as_sb3(gymnasium.make_vec(env_id, num_envs, "vector_entry_point", **settings))


def single(env_id: str, **kwargs: Any) -> Any:
    return gymnasium.make(env_id, preset="easy", attack_budget=2, **SMALL, **kwargs).unwrapped


@pytest.fixture(scope="module")
def attacker() -> MaskablePPO:
    model = MaskablePPO("MlpPolicy", VecMonitor(envs(ATTACK, 16)), n_steps=32, **FAST)
    return model.learn(2048)


@pytest.fixture(scope="module")
def defender() -> PPO:
    model = PPO("MlpPolicy", VecMonitor(envs(DEFENSE, 16, defense_action="platoon")), n_steps=32, **FAST)
    return model.learn(2048)


def test_maskable_ppo_trains_on_the_attack(attacker: MaskablePPO) -> None:
    assert attacker.num_timesteps >= 2048
    episodes = [episode["l"] for episode in attacker.ep_info_buffer]
    assert episodes
    assert set(episodes) == {10}  # decisions in 10 s
    mean, _ = evaluate_maskable(attacker, VecMonitor(envs(ATTACK)), n_eval_episodes=8)
    assert np.isfinite(mean)
    assert mean > 0


def test_ppo_trains_on_the_defence(defender: PPO) -> None:
    assert defender.num_timesteps >= 2048
    assert {episode["l"] for episode in defender.ep_info_buffer} == {20}
    mean, _ = evaluate_policy(defender, VecMonitor(envs(DEFENSE, defense_action="platoon")), n_eval_episodes=8)
    assert np.isfinite(mean)
    assert mean < 0


def test_models_play_as_opponents(attacker: MaskablePPO, defender: PPO) -> None:
    platoon = {"defense_action": "platoon"}
    for env_id, opponent in ((ATTACK, defender), (DEFENSE, attacker)):
        env = single(env_id, opponent=opponent, **platoon)
        _, info = env.reset(seed=0)
        ended = False
        while not ended:
            _, _, terminated, truncated, info = env.step(Crew(env, 1).act(info))
            ended = terminated or truncated
        assert info["disbanded_platoons"] > 0 or env_id == ATTACK


def test_a_masked_opponent_is_handed_its_masks(attacker: MaskablePPO) -> None:
    seen = []

    class Spy:
        def predict(
            self,
            observation: Any,
            state: Any = None,
            episode_start: Any = None,
            deterministic: bool = False,
            action_masks: Any = None,
        ) -> Any:
            seen.append(action_masks)
            actions, state = attacker.predict(observation, state, episode_start, deterministic, action_masks)
            assert action_masks[np.arange(len(actions)), actions].all()
            return actions, state

    env = envs(DEFENSE, 3, opponent=Spy())
    env.reset()
    for _ in range(25):
        env.step(np.zeros((3, 9)))
    assert all(mask.shape == (3, 4) for mask in seen)


@pytest.mark.parametrize("metrics", [False, True])
def test_terminal_observation_and_info_are_those_of_the_single_environment(metrics: bool) -> None:
    batch = envs(ATTACK, 3, opponent="none")
    batch.metrics = metrics
    batch.seed(5)
    first = batch.reset()
    singles = [single(ATTACK, opponent="none") for _ in range(3)]
    results = [env.reset(seed=training_seed(5) + b) for b, env in enumerate(singles)]
    np.testing.assert_array_equal(first, [observation for observation, _ in results])
    crew = Crew(batch.env, 3)
    for step in range(10):
        actions = crew.act({"action_mask": np.stack(batch.env_method("action_masks"))})
        observation, reward, done, infos = batch.step(actions)
        expected = [env.step(action) for env, action in zip(singles, actions, strict=True)]
        np.testing.assert_allclose(reward, [result[1] for result in expected], rtol=1e-6)
        assert done.tolist() == [step == 9] * 3
        if step < 9:
            measured = [{name: value for name, value in each[4].items() if name != "action_mask"} for each in expected]
            assert infos == (measured if metrics else [{}] * 3)
    for b, (last, _, _, truncated, info) in enumerate(expected):
        np.testing.assert_array_equal(infos[b].pop("terminal_observation"), last)
        assert infos[b].pop("TimeLimit.truncated") is truncated is False
        assert infos[b].pop("episode")["l"] == 10
        assert infos[b] == {name: value for name, value in info.items() if name != "action_mask"}
        np.testing.assert_array_equal(observation[b], singles[b].reset()[0])


def test_an_end_by_physics_is_no_time_limit() -> None:
    batch = envs(DEFENSE, 8, on_collision="end", opponent="lead", duration_s=60.0, gap_spread=0.5, speed_spread_mps=5.0)
    batch.seed(0)
    batch.reset()
    ends = []
    for _ in range(120):
        _, _, done, infos = batch.step(np.ones((8, 9)))
        ends += [infos[b]["TimeLimit.truncated"] for b in np.flatnonzero(done)]
    assert False in ends


def test_attributes_methods_and_seeds() -> None:
    batch = envs(ATTACK, 4)
    assert batch.get_attr("render_mode") == [None] * 4
    assert batch.has_attr("action_masks")
    assert not batch.has_attr("no_such_thing")
    assert not envs(DEFENSE).has_attr("action_masks")
    assert batch.get_attr("num_envs", indices=[0, 2]) == [4, 4]
    batch.seed(3)
    first = batch.reset()
    batch.seed(3)
    np.testing.assert_array_equal(first, batch.reset())
    assert (batch.reset() != first).any()
    assert [mask.shape for mask in batch.env_method("action_masks", indices=1)] == [(4,)]
    assert batch.env_is_wrapped(gymnasium.Wrapper) == [False] * 4
    batch.set_attr("note", 1)
    assert batch.get_attr("note") == [1] * 4
    with pytest.raises(ValueError, match="one object"):
        batch.set_attr("note", 2, indices=0)
    batch.close()


def test_frames_are_tiled() -> None:
    pytest.importorskip("matplotlib")
    batch = envs(ATTACK, 2, render_mode="rgb_array")
    batch.reset()
    frame = batch.render()
    assert frame is not None
    assert (frame.dtype, frame.shape[2]) == (np.uint8, 3)


def test_wrong_environments_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="same_step"):
        as_sb3(gymnasium.make_vec(ATTACK, 2, "vector_entry_point"))
    with pytest.raises(ConfigurationError, match="make_vec"):
        as_sb3(gymnasium.make_vec("CartPole-v1", 2))


def test_missing_library_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("stable_baselines3"):
            raise ImportError(f"No module named {name!r}")
        return real(name, *args, **kwargs)

    monkeypatch.delitem(sys.modules, "cps_agents.sb3")
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match=r"cps-envs\[sb3\]"):
        importlib.import_module("cps_agents.sb3")
