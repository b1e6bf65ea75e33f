"""Networks of other libraries, kept so that every command plays them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cps_envs
from cps_agents.zoo.own import save_network
from cps_agents.zoo.wired import Head, WiredPolicy
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import AnalyticPolicy
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, Generators, Knowledge, Role, State, other


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
    name = save_network(tmp_path / "mine", envs, layers, log_deviation=deviation, stickiness=0.5)
    assert name == f"zoo:{tmp_path / 'mine'}"
    wiring = envs.single_observation_space.wiring
    spec = envs.game.spec(envs.role)
    first, bias, last, offset = (np.float32(each) for each in (first, bias, last, offset))  # as the file has them

    def outputs(rows: Any) -> Any:
        return np.tanh(rows @ first.T + bias) @ last.T + offset

    kept = resolve_policy(name, spec)
    assert isinstance(kept, WiredPolicy)
    both = Both(kept, WiredPolicy(spec, wiring, outputs, Head(stickiness=0.5)))
    players: dict[Role, Any] = {envs.role: both, other(envs.role): "none"}
    play_episodes(envs.problem, envs.config, players, range(3))
    assert both.compared >= 100


def test_what_does_not_fit_is_refused(tmp_path: Path) -> None:
    envs = cps_envs.learning_env("RogueAttack", 2, opponent="none")
    layers = layers_of(envs)
    with pytest.raises(ConfigurationError, match=r"the layers have the shapes \[\(3, 8\)\]"):
        save_network(tmp_path, envs, layers[1:])
    with pytest.raises(ConfigurationError, match="activation = 'gelu' must be one of tanh, relu"):
        save_network(tmp_path, envs, layers, activation="gelu")
    assert not list(tmp_path.iterdir())
