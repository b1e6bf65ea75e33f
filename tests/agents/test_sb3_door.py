"""The door for stable-baselines3: how its learners start, learn, are saved, and play again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.declare.seeds import training_seed
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

from sb3_contrib import MaskablePPO, RecurrentPPO
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.vec_env import VecMonitor

from cps_agents.sb3 import as_sb3, make
from cps_envs.core.policies.trust import vouched

pytestmark = pytest.mark.usefixtures("one_thread")
TOYS = "tests.core.toy:toys/"
ATTACK, DEFENSE = f"{TOYS}ToyAttack-v0", f"{TOYS}ToyDefense-v0"
TEAM = {"adapter": "axis", "recent_s": (2.0,), "frame_skip": 2}
FAST: dict[str, Any] = {"n_steps": 16, "batch_size": 64, "n_epochs": 2, "device": "cpu", "seed": 0}


def unstaggered(env: Any) -> Any:
    """The rows of a run's first episodes, all at their first step."""
    return env.reset(seed=0, options={"staggered": False})[0]


def inner(envs: Any) -> Any:
    """The vector environment within the layers of stable-baselines3."""
    return envs.venv.env


@pytest.mark.parametrize(
    ("name", "algorithm", "policy", "options"),
    [
        (ATTACK, PPO, "MlpPolicy", {"recent_s": (2.0,)}),
        (ATTACK, MaskablePPO, "MlpPolicy", {}),
        (DEFENSE, SAC, "MlpPolicy", {"adapter": "axis"}),
        (DEFENSE, PPO, "MlpPolicy", TEAM),
        (DEFENSE, PPO, "MlpPolicy", {**TEAM, "per_agent": False}),
    ],
)
def test_a_saved_model_plays_as_it_was_trained(
    name: str, algorithm: Any, policy: Any, options: dict[str, Any], tmp_path: Path
) -> None:
    envs = make(name, 6, **options)
    keywords = {**FAST} if algorithm is not SAC else {"device": "cpu", "seed": 0, "learning_starts": 10}
    model = algorithm(policy, envs, **keywords).learn(300)
    model.save(tmp_path / "model")
    env = inner(envs)
    returns, ended, rows = np.zeros(6), np.zeros(6, np.bool_), unstaggered(env)
    while not ended.all():
        actions, _ = model.predict(rows, deterministic=True)
        if algorithm is MaskablePPO:
            actions, _ = model.predict(rows, deterministic=True, action_masks=env.action_masks())
        rows, reward, over, _, _ = env.step(actions)
        returns += reward.reshape(6, -1).sum(axis=1) * ~ended
        ended |= over.reshape(6, -1)[:, 0]
    with vouched():
        reference = f"sb3:{tmp_path / 'model.zip'}?algorithm={algorithm.__name__}"
        seeds = range(training_seed(0), training_seed(0) + 6)
        played = play_episodes(env.problem, env.config, {env.role: reference, **_rival(env)}, seeds)
    sign = 1 if env.role == "attacker" else -1
    np.testing.assert_allclose(sign * returns, played["return"], atol=1e-6)


def test_a_model_that_knows_no_masks_chooses_among_all_actions(tmp_path: Path) -> None:
    envs = make(ATTACK, 32)
    model = DQN("MlpPolicy", envs, device="cpu", seed=0)
    model.save(tmp_path / "model")
    env = inner(envs)
    with vouched():
        policy = resolve_policy(f"sb3:{tmp_path / 'model.zip'}?algorithm=DQN", env.game.spec("attacker"))
    rows = unstaggered(env)
    env.game.intruder[:] = 4.0  # where two of five moves are illegal
    env._side.player.look()
    rows, masks = env._side.observe(), env.action_masks()
    actions, _ = policy.predict(env.game.observe("attacker"), action_masks=masks)
    chosen, _ = model.predict(rows, deterministic=True)
    np.testing.assert_array_equal(actions, chosen)


def _rival(env: Any) -> Any:
    return {("defender" if env.role == "attacker" else "attacker"): env.opponent}


def test_a_sampled_model_draws_from_each_episode_s_own_generator(tmp_path: Path) -> None:
    envs = make(ATTACK, 4)
    PPO("MlpPolicy", envs, **FAST).save(tmp_path / "model")
    env, path = inner(envs), f"sb3:{tmp_path / 'model.zip'}?sampled=true"
    players = {"attacker": path, "defender": "none"}
    with vouched():
        one = play_episodes(env.problem, env.config, players, range(8))["return"]
        again = play_episodes(env.problem, env.config, players, range(8))["return"]
        apart = [play_episodes(env.problem, env.config, players, [seed])["return"][0] for seed in range(8)]
        greedy = play_episodes(env.problem, env.config, {**players, "attacker": path.partition("?")[0]}, range(8))
    np.testing.assert_array_equal(one, again)
    np.testing.assert_allclose(one, apart)
    assert (one != greedy["return"]).any()


def test_a_recurrent_model_is_handed_its_memory_and_begins_anew_with_each_episode(tmp_path: Path) -> None:
    for name, options in ((ATTACK, {"recent_s": (2.0,)}), (DEFENSE, TEAM)):
        envs = make(name, 4, **options)
        tiny = {"n_lstm_layers": 2, "lstm_hidden_size": 5, "net_arch": [8]}
        model = RecurrentPPO("MlpLstmPolicy", envs, policy_kwargs=tiny, **FAST).learn(64)
        model.save(tmp_path / "model")
        env = inner(envs)
        with vouched():
            players = {env.role: f"sb3:{tmp_path / 'model.zip'}?algorithm=RecurrentPPO", **_rival(env)}
            seeds = range(training_seed(0), training_seed(0) + 4)
            together = play_episodes(env.problem, env.config, players, seeds)["return"]
            alone = [play_episodes(env.problem, env.config, players, [seed])["return"][0] for seed in seeds]
        np.testing.assert_allclose(together, alone)
        rows, state, returns, ended = unstaggered(env), None, np.zeros(4), np.zeros(4, np.bool_)
        starts = np.ones(env.num_envs, np.bool_)
        while not ended.all():
            actions, state = model.predict(rows, state, starts, deterministic=True)
            rows, reward, over, _, _ = env.step(actions)
            starts = over
            returns += reward.reshape(4, -1).sum(axis=1) * ~ended
            ended |= over.reshape(4, -1)[:, 0]
        sign = 1 if env.role == "attacker" else -1
        np.testing.assert_allclose(sign * returns, together, atol=1e-6)


def test_settings_are_those_of_any_algorithm_with_rollouts() -> None:
    envs = make(ATTACK, 4)
    for algorithm, policy in ((PPO, "MlpPolicy"), (RecurrentPPO, "MlpLstmPolicy")):
        algorithm(policy, envs, **{**envs.settings, "n_steps": 4, "batch_size": 16}).learn(16)


def test_the_return_is_on_the_screen(capsys: pytest.CaptureFixture[str]) -> None:
    PPO("MlpPolicy", make(ATTACK, 8), verbose=1, **FAST).learn(8 * 16)
    assert "ep_rew_mean" in capsys.readouterr().out


def test_seeds_are_far_from_evaluations() -> None:
    envs = make(ATTACK, 4)
    model = PPO("MlpPolicy", envs, **{**FAST, "seed": 3})
    model.learn(64)
    assert inner(envs)._run == 3
    plain = as_sb3(gymnasium.make_vec("toys/ToyAttack-v0", 2, "vector_entry_point", autoreset="same_step"))
    plain.seed(0)
    shown = plain.reset()
    expected = gymnasium.make("toys/ToyAttack-v0").reset(seed=training_seed(0))[0]
    np.testing.assert_array_equal(shown[0], expected)
    with pytest.raises(ConfigurationError, match="numbers a training run"):
        plain.seed(123_456)


def test_nonsense_is_refused(tmp_path: Path) -> None:
    wrapped = gymnasium.wrappers.vector.TransformReward(
        gymnasium.make_vec("toys/ToyAttack-v0", 2, "vector_entry_point", autoreset="same_step"), lambda r: r
    )
    with pytest.raises(ConfigurationError, match="wraps a vector environment"):
        as_sb3(wrapped)
    plain = VecMonitor(as_sb3(wrapped.unwrapped))
    envs = make(ATTACK, 2)
    PPO("MlpPolicy", envs, **FAST).save(tmp_path / "model")
    env = inner(envs)
    with vouched(), pytest.raises(ConfigurationError, match="as the attacker of toy, not as the defender"):
        resolve_policy(f"sb3:{tmp_path / 'model.zip'}", env.game.spec("defender"))
    DQN("MlpPolicy", plain, device="cpu").save(tmp_path / "plain")
    reference = f"sb3:{tmp_path / 'plain.zip'}?algorithm=DQN&sampled=true"
    with vouched(), pytest.raises(ConfigurationError, match="DQN has no distribution of actions to draw from"):
        resolve_policy(reference, env.game.spec("attacker"))
