"""One model of stable-baselines3 has one meaning, in whatever door it is judged: the table of doors by kinds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.panel import mixture, written
from cps_envs.core.declare.seeds import VALIDATION, training_seed
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.trust import vouched
from tests.core.toy import TOY

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

import torch
from sb3_contrib import MaskablePPO, RecurrentPPO
from sb3_contrib.common.maskable.evaluation import evaluate_policy as evaluate_masked
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize

from cps_agents.sb3 import as_sb3, make

pytestmark = pytest.mark.usefixtures("one_thread")
ATTACK, DEFENSE = "toys/ToyAttack-v0", "toys/ToyDefense-v0"
EPISODES, FRAMES = 6, 3
CONFIG = TOY.config("learning", {})
ALGORITHMS: dict[str, Any] = {"recurrent": RecurrentPPO, "masked": MaskablePPO}
KINDS = ("most likely", "sampled", "recurrent", "normalised", "masked", "stacked")
TABLE = [(form, kind) for form in ("learning", "native") for kind in KINDS if (form, kind) != ("learning", "stacked")]
SMALL: dict[str, Any] = {"n_steps": 8, "batch_size": 8, "device": "cpu", "seed": 0}


def batch(form: str) -> Any:
    """As stable-baselines3 sees the attacker, through the interface for learners or as it is."""
    options = {"preset": "learning", "interface": form, "opponent": "none", "autoreset": "same_step"}
    return as_sb3(gymnasium.make_vec(ATTACK, EPISODES, "vector_entry_point", **options))


def layered(envs: Any, kind: str) -> Any:
    """Environments as a model of this kind sees them."""
    if kind == "normalised":
        envs = VecNormalize(envs, training=False, norm_reward=False)
        size = envs.observation_space.shape[0]
        envs.obs_rms.mean, envs.obs_rms.var = np.linspace(-0.5, 0.5, size), np.linspace(0.1, 2.0, size)
    return VecFrameStack(envs, FRAMES) if kind == "stacked" else envs


@cache
def trained(form: str, kind: str) -> tuple[Any, Path, str]:
    """A model whose actions vary, its file, and the reference that plays it."""
    algorithm = ALGORITHMS.get(kind, PPO)
    envs = layered(batch(form), kind)
    model = algorithm("MlpLstmPolicy" if kind == "recurrent" else "MlpPolicy", envs, **SMALL)
    torch.manual_seed(1)
    for weights in model.policy.parameters():
        torch.nn.init.normal_(weights, 0.0, 0.3)
    path = Path(mkdtemp()) / "model.zip"
    model.save(path)
    options = {"algorithm": algorithm.__name__, **options_of(path, kind)}
    if kind == "normalised":
        envs.save(path.with_name("statistics"))
    return model, path, written(f"sb3:{path}", **options)


def options_of(path: Path, kind: str) -> dict[str, Any]:
    known = {"sampled": {"sampled": True}, "stacked": {"frame_stack": FRAMES}}
    return {"vecnormalize": str(path.with_name("statistics"))} if kind == "normalised" else known.get(kind, {})


def seeds_of(form: str) -> range:
    """The episodes that `evaluate_policy` plays in environments of this form."""
    first = VALIDATION.start if form == "learning" else training_seed(0)
    return range(first, first + EPISODES)


@cache
def by_hand(form: str, kind: str) -> list[float]:
    """The payoffs of a loop over one environment that asks the model itself."""
    model = trained(form, kind)[0]
    return [alone(model, form, kind, seed) for seed in seeds_of(form)]


def alone(model: Any, form: str, kind: str, seed: int) -> float:
    env = gymnasium.make(ATTACK, preset="learning", interface=form, opponent="none").unwrapped
    own = seeded([seed])[0].spawn(2)[0]  # the attacker's
    row, info = env.reset(seed=seed)
    frames, state, start, total, ended = np.zeros((FRAMES, len(row)), np.float32), None, True, 0.0, False
    size = len(row)
    while not ended:
        seen = row
        if kind == "normalised":
            seen = np.clip((row - np.linspace(-0.5, 0.5, size)) / np.sqrt(np.linspace(0.1, 2.0, size) + 1e-8), -10, 10)
        if kind == "stacked":
            frames = np.concatenate([frames[1:], row[np.newaxis]])
            seen = frames.reshape(-1)
        extras = {"action_masks": info["action_mask"]} if kind == "masked" else {}
        if kind == "sampled" and form == "learning":
            with torch.no_grad():
                logits = model.policy.get_distribution(torch.as_tensor(seen[np.newaxis])).distribution.logits.numpy()
            action = (logits + own.gumbel(size=(1, 5))).argmax()
        elif kind == "sampled":
            torch.manual_seed(int(own.integers(2**63 - 1)))
            action, _ = model.predict(seen, deterministic=False)
        else:
            action, state = model.predict(seen, state, np.array([start]), deterministic=True, **extras)
        row, reward, terminated, truncated, info = env.step(int(action))
        total, start, ended = total + float(reward), False, terminated or truncated
    return total


def played(subject: Any, form: str) -> list[float]:
    with vouched():
        players = {"attacker": subject, "defender": "none"}
        return list(play_episodes(TOY, CONFIG, players, seeds_of(form))["return"])


def through_object(form: str, kind: str) -> list[float]:
    model, _, _ = trained(form, kind)
    return played(resolve_policy(model, spec(), sampled=True) if kind == "sampled" else model, form)


def through_network(form: str, kind: str) -> list[float]:
    model, path, _ = trained(form, kind)
    with vouched():
        return played(resolve_policy(model.policy, spec(), **options_of(path, kind)), form)


def through_file(form: str, kind: str) -> list[float]:
    return played(trained(form, kind)[2], form)


def through_opponent(form: str, kind: str) -> list[float]:
    with vouched():
        env: Any = gymnasium.make(DEFENSE, preset="learning", interface="native", opponent=trained(form, kind)[2])
    found = []
    for seed in seeds_of(form):
        env.reset(seed=seed)
        total, ended = 0.0, False
        while not ended:
            _, reward, terminated, truncated, _ = env.step(np.zeros(2, np.float32))
            total, ended = total - float(reward), terminated or truncated
        found.append(total)
    return found


def through_mixture(form: str, kind: str) -> list[float]:
    return played(mixture([trained(form, kind)[2]]), form)


def through_evaluate_policy(form: str, kind: str) -> list[float]:
    envs = make(ATTACK, EPISODES, evaluation=True, opponent="none") if form == "learning" else batch(form)
    envs.seed(0)
    evaluate: Any = evaluate_masked if kind == "masked" else evaluate_policy
    model, _, _ = trained(form, kind)
    found, _ = evaluate(model, layered(envs, kind), EPISODES, return_episode_rewards=True)
    return list(found)


def spec() -> Any:
    return TOY.game(CONFIG, 1).spec("attacker")


DOORS: Sequence[Callable[[str, str], list[float]]] = (
    through_object,
    through_network,
    through_file,
    through_opponent,
    through_mixture,
    through_evaluate_policy,
)


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize(("form", "kind"), TABLE)
def test_a_model_plays_in_every_door_as_in_a_loop_by_hand(
    door: Callable[[str, str], list[float]], form: str, kind: str
) -> None:
    if kind == "sampled" and door in (through_mixture, through_evaluate_policy):
        pytest.skip("a mixture hands on generators of its own, and stable-baselines3 draws by itself: see below")
    np.testing.assert_allclose(sorted(door(form, kind)), sorted(by_hand(form, kind)), atol=1e-5)
