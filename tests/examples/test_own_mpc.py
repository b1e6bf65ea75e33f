"""The controller in one file: it plays as `mpc` does, and knows what to do where no command keeps all limits."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.policies.policy import AnalyticPolicy, RoleSpec
from cps_envs.core.policies.seen import Seen
from cps_envs.core.types import Array, State
from cps_envs.disbanding.problem import DISBANDING
from tests.agents.command_line import succeeded
from tests.turns import in_turn

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def own_mpc(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return import_module("own_mpc")


class Beside(AnalyticPolicy):
    """Plays `mpc`, and keeps what another policy would have played."""

    def __init__(self, spec: RoleSpec, other: AnalyticPolicy) -> None:
        super().__init__(spec)
        self.leading, self.other = resolve_policy("mpc", spec), other
        self.played: list[tuple[Array, Array]] = []

    def begin(self, generators: Any, knowledge: Any) -> State:
        return self.leading.begin(generators, knowledge)

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        actions, state = self.leading.act(seen, state)
        self.played.append((actions, self.other.act(seen, None)[0]))
        return actions, state


def side_by_side(own_mpc: Any, **overrides: Any) -> tuple[Array, Array]:
    """The actions (decisions, 1, M) of `mpc` and of the example in an episode of preset `paper`."""
    config = DISBANDING.config("paper", overrides)
    spec = DISBANDING.game(config, 1).spec("defender")
    both = Beside(spec, own_mpc.OwnMpc(spec))
    play_episodes(DISBANDING, config, {"attacker": "lead", "defender": both}, [0])
    mpc, own = map(np.array, zip(*both.played, strict=True))
    assert len(mpc) == config.duration_s / config.control_period_s
    return mpc, own


@pytest.mark.parametrize("tau_s", in_turn([0.1, 0.3], 2))
def test_it_plays_as_mpc(own_mpc: Any, tau_s: float) -> None:
    """What is left, 0.9e-6 and no less with a tighter OSQP, is where the dual iteration of `mpc` ends."""
    mpc, own = side_by_side(own_mpc, tau_s=tau_s, num_platoons=2)
    assert (np.abs(mpc) > 0.1).any()
    np.testing.assert_allclose(own, mpc, atol=1e-6)


@pytest.mark.slow
def test_it_plays_as_mpc_behind_nine_platoons(own_mpc: Any) -> None:
    """There the cap of 60 sweeps ends some programs of `mpc` a little before their optimum."""
    mpc, own = side_by_side(own_mpc, tau_s=0.3)
    np.testing.assert_allclose(own, mpc, atol=2e-5)


def test_it_brakes_where_no_command_keeps_all_limits(own_mpc: Any) -> None:
    config = DISBANDING.config("paper", {"tau_s": 0.5})
    policy = own_mpc.OwnMpc(DISBANDING.game(config, 1).spec("defender"))
    motion = {"speed": np.array([20.0, 20.0]), "acceleration": np.zeros(2), "desired_gap_m": 5.0, "tau_s": 0.5}
    assert policy.command(motion, q=1, gap=-3.0, closing=-1.0, ahead=-5.0) == config.min_acceleration_mps2


def test_the_command_line_plays_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    short = ("--set", "num_platoons=2", "--set", "duration_s=10")
    players = ("--attacker", "lead", "--defender", "own_mpc:OwnMpc")
    result = succeeded("--trust", "play", "disbanding", "--preset", "paper", *short, *players)
    assert "own_mpc:OwnMpc" in result.output
