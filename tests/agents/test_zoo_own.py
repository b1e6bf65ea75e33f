"""Networks of other libraries, kept so that every command plays them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import cps_envs
from cps_agents.zoo.files import load
from cps_agents.zoo.lookup import playable
from cps_agents.zoo.own import save_network
from cps_agents.zoo.wired import Head, WiredPolicy
from cps_envs import rogue_v0
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import AnalyticPolicy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, Role, State, other

ROGUE = "cps_envs:cps_envs/RogueAttack-v0"


def layers_of(envs: Any, hidden: int = 8) -> list[Any]:
    generator = np.random.default_rng(0)
    columns = envs.wired.columns
    sizes = [columns.size, hidden, columns.last_action]
    return [
        (generator.normal(0, 0.1, (after, before)), generator.normal(0, 0.1, after))
        for before, after in pairwise(sizes)
    ]


class Both(AnalyticPolicy):
    """Plays the first of two policies, and checks that the second one would always have done the same."""

    def __init__(self, first: WiredPolicy, second: WiredPolicy) -> None:
        super().__init__(first.spec)
        self.masked, self.decentralised = first.masked, first.decentralised
        self.policies, self.compared = (first, second), 0

    def begin(self, generators: Generators, knowledge: Knowledge) -> State:
        states = [policy.begin(generators, knowledge) for policy in self.policies]
        return (*states[0], *states[1])

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        half = len(state) // 2
        (action, own), (expected, other_own) = (
            policy.act(seen, part) for policy, part in zip(self.policies, (state[:half], state[half:]), strict=True)
        )
        np.testing.assert_allclose(action, expected, rtol=0, atol=1e-5)
        self.compared += 1
        return action, (*own, *other_own)


@pytest.mark.parametrize("role", ["RogueAttack", "FdiDefense", "DisbandingDefense"])
def test_it_plays_as_its_outputs_say(role: str, tmp_path: Path) -> None:
    envs: Any = cps_envs.learning_env(role, 2, opponent="none")
    (first, bias), (last, offset) = layers = layers_of(envs)
    deviation = None if envs.wired.choices else np.zeros(len(offset))
    name = save_network(tmp_path / "mine", envs, layers, log_deviation=deviation)
    assert name == f"zoo:{tmp_path / 'mine'}"
    wiring = envs.single_observation_space.wiring
    spec = envs.game.spec(envs.role)
    first, bias, last, offset = (np.float32(each) for each in (first, bias, last, offset))  # as the file has them

    def outputs(rows: Any) -> Any:
        return np.tanh(rows @ first.T + bias) @ last.T + offset

    kept = resolve_policy(name, spec)
    assert isinstance(kept, WiredPolicy)
    both = Both(kept, WiredPolicy(spec, wiring, outputs, Head()))
    players: dict[Role, Any] = {envs.role: both, other(envs.role): "none"}
    play_episodes(envs.problem, envs.config, players, range(3))
    assert both.compared >= 100


def test_what_does_not_fit_is_refused(tmp_path: Path) -> None:
    envs = cps_envs.learning_env("RogueAttack", 2, opponent="none")
    layers = layers_of(envs)
    with pytest.raises(ConfigurationError, match=r"the layers have the shapes \(3, 8\) \(outputs, inputs\), but a row"):
        save_network(tmp_path / "short", envs, layers[1:])
    with pytest.raises(ConfigurationError, match="activation = 'gelu' must be one of tanh, relu"):
        save_network(tmp_path / "gelu", envs, layers, activation="gelu")
    with pytest.raises(ConfigurationError, match=r"is no dense layer: write nn\.Linear, or a pair of weight and bias"):
        save_network(tmp_path / "odd", envs, [3])
    with pytest.raises(ConfigurationError, match='make it with interface="learning"'):
        save_network(tmp_path / "native", gymnasium.make(ROGUE, interface="native"), layers)
    parallel = rogue_v0.parallel_env()
    with pytest.raises(ConfigurationError, match="agent = None must be one of attacker_0"):
        save_network(tmp_path / "nobody", parallel, layers)
    for name in ("short", "gelu"):
        with np.load(tmp_path / name / "weights.npz") as kept:
            np.testing.assert_array_equal(kept["arr_0"], layers[1 if name == "short" else 0][0])


def test_all_forms_of_a_network_are_kept_alike(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    env = gymnasium.make(ROGUE, opponent="none")
    size = env.observation_space.shape[0]  # type: ignore[index]
    first, last = torch.nn.Linear(size, 8), torch.nn.Linear(8, 3)
    pairs = [(each.weight.detach().numpy(), each.bias.detach().numpy()) for each in (first, last)]
    nested = torch.nn.Sequential(torch.nn.Sequential(first, torch.nn.ReLU()), last)
    flax = {f"Dense_{place}": {"kernel": weight.T, "bias": bias} for place, (weight, bias) in enumerate(pairs)}
    forms = {"pairs": pairs, "linear": [first, last], "nested": nested, "flax": {"params": flax}, "plain": flax}
    for name, layers in forms.items():
        save_network(tmp_path / name, env, layers, activation=None if name == "nested" else "relu")
    networks = [load(tmp_path / name / "policy.json")[1] for name in forms]
    for network in networks:
        assert network.activation == "relu"
        for (weight, bias), (other_weight, other_bias) in zip(network.layers, networks[0].layers, strict=True):
            np.testing.assert_array_equal(weight, other_weight)
            np.testing.assert_array_equal(bias, other_bias)


@pytest.mark.parametrize(("role", "options"), [("HvacDefense", {}), ("RogueAttack", {"flat": True})])
def test_a_single_environment_and_the_policy_kept_from_it_do_the_same(
    role: str, options: dict[str, Any], tmp_path: Path
) -> None:
    """A network of all agents of a team, too."""
    env: Any = gymnasium.make(f"cps_envs:cps_envs/{role}-v0", opponent="none", **options).unwrapped
    generator = np.random.default_rng(1)
    choices = np.ravel(getattr(env.action_space, "nvec", getattr(env.action_space, "n", 0))).tolist()
    layer = generator.normal(0, 1, (sum(choices), env.observation_space.shape[0])), generator.normal(0, 1, sum(choices))
    name = save_network(tmp_path / "mine", env, [layer])
    row, _ = env.reset(seed=3)
    total, over = 0.0, False
    while not over:
        logits = np.float32(layer[0]) @ row + np.float32(layer[1])
        parts = np.split(logits, np.cumsum(choices)[:-1])
        action = np.array([part.argmax() for part in parts]).reshape(env.action_space.shape)
        row, reward, over, _, _ = env.step(action)
        total += reward
    played = play_episodes(env.problem, env.config, {env.role: name, other(env.role): "none"}, [3])
    assert total == pytest.approx((1 if env.role == "attacker" else -1) * played["return"][0], abs=1e-9)


class Counts:
    """Remembers how often it has decided in an episode, and acts by that."""

    def __init__(self, space: Any, entries: int) -> None:
        self.observation_space, self.entries, self.seen = space, entries, list[int]()

    def predict(
        self, observation: Array, state: Any = None, episode_start: Any = None, deterministic: bool = False
    ) -> Any:
        before = np.zeros(len(observation), np.int64) if state is None else state[0]
        assert (before[episode_start] == 0).all()
        self.seen.append(int(before.max()))
        actions = np.repeat((before % 2)[:, np.newaxis], self.entries, axis=1)
        return actions if self.entries > 1 else actions[:, 0], (before + 1,)


@pytest.mark.parametrize(("role", "per_agent"), [("RogueAttack", False), ("HvacDefense", True), ("HvacDefense", False)])
def test_whatever_remembers_is_handed_its_state(role: str, per_agent: bool) -> None:
    envs: Any = cps_envs.learning_env(role, 2, opponent="none", per_agent=per_agent)
    brain = Counts(envs.single_observation_space, int(np.prod(envs.single_action_space.shape or (1,))))
    policy = playable(brain, envs.game.spec(envs.role))
    players: dict[Role, Any] = {envs.role: policy, other(envs.role): "none"}
    seeds = range(8)
    together = play_episodes(envs.problem, envs.config, players, seeds)["return"]
    alone = [play_episodes(envs.problem, envs.config, players, [seed])["return"][0] for seed in seeds]
    np.testing.assert_array_equal(together, alone)
    assert max(brain.seen) <= envs.decisions - 1
    assert max(brain.seen) > 2
