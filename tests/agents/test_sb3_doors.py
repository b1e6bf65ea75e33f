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
from cps_envs.core.errors import ConfigurationError, UnknownNameError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.policies.trust import vouched
from tests.core.toy import TOY

pytest.importorskip("stable_baselines3")
pytest.importorskip("sb3_contrib")

import torch
from sb3_contrib import MaskablePPO, RecurrentPPO
from sb3_contrib.common.maskable.evaluation import evaluate_policy as evaluate_masked
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
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


def test_stable_baselines3_draws_alike_from_one_seed() -> None:
    model, _, _ = trained("learning", "sampled")
    judged = make(ATTACK, EPISODES, evaluation=True, opponent="none")
    found = []
    for seed in (0, 0, 1):
        torch.manual_seed(seed)
        found.append(evaluate_policy(model, judged, EPISODES, deterministic=False)[0])
    assert found[0] == found[1] != found[2]
    assert found[0] != np.mean(through_evaluate_policy("learning", "most likely"))


@pytest.mark.parametrize("form", ["learning", "native"])
def test_draws_come_from_each_episode_s_own_generator_and_have_the_model_s_chances(form: str) -> None:
    model, _, reference = trained(form, "sampled")
    players = {"attacker": mixture([reference, reference]), "defender": "none"}
    with vouched():
        torch.manual_seed(0)
        one = play_episodes(TOY, CONFIG, players, range(12))["return"]
        torch.manual_seed(1)
        again = play_episodes(TOY, CONFIG, players, range(12))["return"]
        alone = [play_episodes(TOY, CONFIG, players, [seed])["return"][0] for seed in range(12)]
    np.testing.assert_array_equal(one, again)
    np.testing.assert_allclose(one, alone)
    policy: Any = resolve_policy(model, spec(), sampled=True)
    count = 2000 if form == "learning" else 300  # one call of the network each
    shown = np.repeat(TOY.game(CONFIG, 1).observe("attacker"), count, axis=0)
    state = policy.begin(seeded(range(count)), [{}] * count)
    masks = np.ones((count, 5), np.bool_)
    actions, _ = policy.predict(shown, state, np.ones(count, np.bool_), False, action_masks=masks)
    rows = policy.wired.inputs(*seen_of(policy, shown[:1]))[:, 0]
    with torch.no_grad():
        chances = model.policy.get_distribution(torch.as_tensor(rows)).distribution.probs.numpy()[0]
    np.testing.assert_allclose(np.bincount(actions, minlength=5) / count, chances, atol=2.5 / np.sqrt(count))


def test_each_evaluation_plays_the_same_episodes_to_their_ends() -> None:
    model, _, _ = trained("learning", "most likely")
    whole = []
    for rows in (2, 3, EPISODES):
        judged = make(ATTACK, rows, evaluation=True, opponent="none")
        assert judged.env_is_wrapped(Monitor) == [True] * rows
        before = judged.ret_rms.mean.copy()
        found, lengths = evaluate_policy(model, judged, EPISODES, return_episode_rewards=True)
        assert set(lengths) <= set(range(1, 5))
        assert judged.ret_rms.mean == before
        assert found == evaluate_policy(model, judged, EPISODES, return_episode_rewards=True)[0]
        whole.append(sorted(found))
    np.testing.assert_allclose(whole[0], whole[2], atol=1e-5)
    np.testing.assert_allclose(whole[1], whole[2], atol=1e-5)


def test_an_evaluation_has_the_inputs_of_training() -> None:
    for role in ("HvacAttack", "HvacDefense"):
        assert make(role, 2).observation_space == make(role, 2, evaluation=True).observation_space
    other = make("HvacAttack", 2, evaluation=True, outdoor_c=0.0)
    assert other.observation_space != make("HvacAttack", 2).observation_space
    alike = make("HvacAttack", 2, evaluation=True, outdoor_c=0.0, scaling=make("HvacAttack", 2).observation_space)
    assert alike.observation_space == make("HvacAttack", 2).observation_space
    with pytest.raises(ConfigurationError, match="a model's observation_space of the interface for learners"):
        make(ATTACK, 2, scaling=trained("learning", "most likely")[0])
    with pytest.raises(ConfigurationError, match="numbers a block of validation episodes: choose one from 0 to 99"):
        make(ATTACK, 2, evaluation=True).env_method("reset", seed=100)


def test_the_first_episodes_of_training_count_only_if_they_are_whole() -> None:
    envs = make(ATTACK, 32, opponent="none", duration_s=60.0)
    envs.reset()
    lengths = []
    for _ in range(2 * 20):
        _, _, done, infos = envs.step(np.zeros(32, np.int64))
        lengths += [info["episode"]["l"] for info, over in zip(infos, done, strict=True) if over and "episode" in info]
    assert set(lengths) == {20}


def test_a_callback_keeps_the_best_model_by_its_true_return(tmp_path: Path) -> None:
    judged = make(ATTACK, EPISODES, evaluation=True, opponent="none")
    callback = EvalCallback(
        judged, n_eval_episodes=EPISODES, eval_freq=4, best_model_save_path=str(tmp_path), verbose=0
    )
    PPO("MlpPolicy", make(ATTACK, 4, opponent="none"), **SMALL).learn(64, callback=callback)
    found = played(f"sb3:{tmp_path / 'best_model.zip'}", "learning")
    assert callback.best_mean_reward == pytest.approx(np.mean(found))


@pytest.mark.parametrize(
    ("form", "kind", "query", "reason"),
    [
        ("native", "normalised", {}, "beside .*model.zip lies statistics, of VecNormalize: say vecnormalize="),
        ("learning", "normalised", {}, "beside .*model.zip lies statistics, of VecNormalize: say vecnormalize="),
        ("native", "normalised", {"vecnormalize": "nothing.pkl"}, "there is no file 'nothing.pkl'"),
        ("native", "most likely", {"vecnormalize": "model.zip"}, "is no file of VecNormalize, or damaged"),
        ("native", "stacked", {}, "sees 15 inputs, 3 times those of the role: say frame_stack=3"),
        ("native", "stacked", {"frame_stack": 2}, "sees 15 inputs, 3 times those of the role: say frame_stack=3"),
        ("native", "most likely", {"frame_stack": 2}, "has the observation_space Box"),
        ("native", "most likely", {"frame_stack": 0}, "frame_stack = 0 must be"),
        ("learning", "most likely", {"frame_stack": 2}, "inputs of the interface for learners, one frame each"),
        ("native", "most likely", {"sampled": "yes"}, "sampled = 'yes' must be true or false"),
        ("native", "most likely", {"stacked": 2}, "has no option 'stacked'"),
    ],
)
def test_what_does_not_fit_a_model_is_refused(
    form: str, kind: str, query: dict[str, Any], reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, path, _ = trained(form, kind)
    monkeypatch.chdir(path.parent)
    with vouched(), pytest.raises((ConfigurationError, UnknownNameError), match=reason):
        resolve_policy(written(f"sb3:{path}", **query), spec())


def test_false_is_obeyed_and_statistics_can_be_left_out() -> None:
    for form in ("learning", "native"):
        _, path, _ = trained(form, "most likely")
        assert played(f"sb3:{path}?sampled=false", form) == played(f"sb3:{path}", form)
        model, path, _ = trained(form, "normalised")
        bare = type(model).load(path, device="cpu")
        assert played(f"sb3:{path}?vecnormalize=", form) == played(bare, form) != through_file(form, "normalised")


def test_what_has_nothing_to_draw_from_says_so() -> None:
    sde = PPO("MlpPolicy", make(f"tests.core.toy:{DEFENSE}", 2, adapter="axis"), use_sde=True, **SMALL)
    guard = TOY.game(CONFIG, 1).spec("defender")
    with pytest.raises(ConfigurationError, match="PPO has no distribution of actions to draw from"):
        resolve_policy(sde, guard, sampled=True)
    with pytest.raises(ConfigurationError, match="algorithm = 'A2C' is not that of this PPO"):
        resolve_policy(sde, guard, algorithm="A2C")


def seen_of(policy: Any, shown: Any) -> Any:
    """What a policy's wiring has seen at an episode's first decision, and its state then."""
    seen = Seen(policy.spec.fields, shown, np.ones(1, np.bool_), False, np.ones((1, 5), np.bool_), None)
    return seen, policy.wired.see(seen, policy.wired.begin(1))
