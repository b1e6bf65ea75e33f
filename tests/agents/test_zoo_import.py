"""Models of stable-baselines3 as weights and a card: they play the same episodes, without it and without any code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")
pytest.importorskip("typer", reason="needs the command line")

from sb3_contrib import QRDQN, MaskablePPO, RecurrentPPO
from stable_baselines3 import A2C, DQN, PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from cps_agents.errors import CommandError
from cps_agents.sb3 import make
from cps_agents.zoo.files import load
from cps_agents.zoo.importing import import_models
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.trust import vouched
from tests.agents.command_line import succeeded

pytestmark = pytest.mark.usefixtures("one_thread")
TOYS = "tests.core.toy:toys/"
ATTACK, DEFENSE = f"{TOYS}ToyAttack-v0", f"{TOYS}ToyDefense-v0"
TEAM = {"adapter": "axis", "recent_s": (2.0,), "frame_skip": 2}
FAST: dict[str, Any] = {"n_steps": 16, "batch_size": 96, "n_epochs": 1, "device": "cpu", "seed": 0}
SMALL = {"n_lstm_layers": 2, "lstm_hidden_size": 5, "net_arch": [8]}


def paid(envs: Any, policy: str) -> Any:
    env = envs.unwrapped.env
    rival: Any = {("defender" if env.role == "attacker" else "attacker"): env.opponent}
    with vouched():
        return play_episodes(env.problem, env.config, {env.role: policy, **rival}, range(8))["return"]


def imported(model: Any, role: str, folder: Path, options: str = "") -> tuple[str, str]:
    """The model as it is and as it is imported."""
    model.save(folder / "model.zip")
    reference = f"sb3:{folder / 'model.zip'}?algorithm={type(model).__name__}{options}"
    with vouched():
        import_models(reference, folder / "out" / "policy.json", role)
    return reference, f"zoo:{folder / 'out'}"


@pytest.mark.parametrize(
    ("name", "algorithm", "options", "more"),
    [
        (ATTACK, PPO, {"recent_s": (2.0,)}, FAST),  # which takes illegal actions, too
        (ATTACK, A2C, {}, {"device": "cpu", "seed": 0, "policy_kwargs": {"activation_fn": nn.ReLU}}),
        (ATTACK, MaskablePPO, {}, FAST),
        (DEFENSE, PPO, TEAM, FAST),
        (ATTACK, RecurrentPPO, {"recent_s": (2.0,)}, {**FAST, "policy_kwargs": SMALL}),
        (DEFENSE, RecurrentPPO, TEAM, FAST),
        (ATTACK, DQN, {}, {"device": "cpu", "seed": 0}),
    ],
)
def test_an_imported_model_plays_the_same_episodes(
    name: str, algorithm: Any, options: Any, more: Any, tmp_path: Path
) -> None:
    envs = make(name, 6, **options)
    policy = "MlpLstmPolicy" if algorithm is RecurrentPPO else "MlpPolicy"
    model = algorithm(policy, envs, **more).learn(96 if algorithm is not DQN else 30)
    model_file, network = imported(model, name, tmp_path)
    np.testing.assert_allclose(paid(envs, network), paid(envs, model_file), atol=1e-6)
    if algorithm is RecurrentPPO:
        with pytest.raises(ConfigurationError, match="most likely actions only: leave deterministic=false out"):
            paid(envs, f"{network}?deterministic=false")


def test_statistics_of_the_inputs_come_along(tmp_path: Path) -> None:
    envs = VecNormalize(make(ATTACK, 6), norm_reward=False, clip_obs=1.5)
    model = PPO("MlpPolicy", envs, **FAST).learn(96)
    envs.save(str(tmp_path / "statistics.pkl"))
    with pytest.raises(ValueError, match=r"beside .* lies statistics\.pkl"):
        imported(model, ATTACK, tmp_path)
    model_file, network = imported(model, ATTACK, tmp_path, f"&vecnormalize={tmp_path / 'statistics.pkl'}")
    assert load(tmp_path / "out" / "policy.json")[1].normal is not None
    np.testing.assert_allclose(paid(envs, network), paid(envs, model_file), atol=1e-6)


def test_a_folder_of_training_seeds_becomes_one_card(tmp_path: Path) -> None:
    for seed in (0, 3):
        (tmp_path / f"seed-{seed}").mkdir()
        A2C("MlpPolicy", make(ATTACK, 6), device="cpu", seed=seed).save(tmp_path / f"seed-{seed}" / "model.zip")
    arguments = ("zoo", "import", f"sb3:{tmp_path}?algorithm=A2C", "--role", ATTACK, "--to", str(tmp_path / "out"))
    text = succeeded("--trust", *arguments).stdout
    assert "training seed" in text
    networks = [load(tmp_path / "out" / "policy.json", seed)[1].layers[0][0] for seed in (0, 3)]
    assert (networks[0] != networks[1]).any()


@pytest.mark.parametrize(
    ("name", "algorithm", "more", "message"),
    [
        (DEFENSE, SAC, {"device": "cpu"}, "squashes its actions"),
        (ATTACK, QRDQN, {"device": "cpu"}, "is a QRDQN: only PPO, A2C"),
        (ATTACK, PPO, {**FAST, "policy_kwargs": {"activation_fn": nn.ELU}}, "has ELU between its layers"),
    ],
)
def test_what_a_card_cannot_describe_is_refused(
    name: str, algorithm: Any, more: Any, message: str, tmp_path: Path
) -> None:
    options = {"adapter": "axis"} if algorithm is SAC else {}
    with pytest.raises(CommandError, match=message):
        imported(algorithm("MlpPolicy", make(name, 6, **options), **more), name, tmp_path)
    assert not (tmp_path / "out" / "policy.json").exists()


def test_mistakes_of_an_import_get_one_sentence(tmp_path: Path) -> None:
    model = A2C("MlpPolicy", make(ATTACK, 6), device="cpu")
    model.save(tmp_path / "model.zip")
    reference = f"sb3:{tmp_path / 'model.zip'}?algorithm=A2C"
    for text, role, message in (
        ("tracker", None, "'tracker' is no model"),
        (reference, None, "is of toy: name its role"),
        (reference, DEFENSE, "was trained as the attacker of toy"),
        (f"{reference}&frame_stack=2", ATTACK, "frame_stack cannot be imported"),
        (f"sb3:{tmp_path / 'none.zip'}", ATTACK, "there is no file"),
    ):
        with vouched(), pytest.raises((CommandError, LookupError), match=message):
            import_models(text, tmp_path / "out" / "policy.json", role)
