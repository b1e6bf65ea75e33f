"""PPO in one file: every kind of role, and a network that any command plays."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_agents.zoo.files import load
from cps_envs.core.declare.actions import choices_of
from tests.agents.command_line import invoke


@pytest.fixture
def cleanrl(monkeypatch: pytest.MonkeyPatch) -> Any:
    pytest.importorskip("torch")
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    return import_module("cleanrl_ppo")


TINY = {"opponent": "none", "cpu_seconds": 0.01, "num_envs": 2, "baseline": "none", "episodes": 2}


@pytest.mark.parametrize(
    ("role", "entries"),
    [("RogueAttack", 1), ("FdiDefense", 3), ("DisbandingAttack", 3), ("DisbandingDefense", 0)],
    ids=["discrete", "team", "masked", "continuous"],
)
def test_an_update_of_every_kind_of_role(cleanrl: Any, role: str, entries: int, tmp_path: Path) -> None:
    arguments = cleanrl.Args(role=role, out=str(tmp_path), **TINY)
    envs, name, _ = cleanrl.train(arguments)
    assert len(choices_of(envs.single_action_space)) == entries
    card, network = load(tmp_path / role / "policy.json")
    assert (card.problem, card.role, card.preset) == (envs.problem.name, envs.role, "learning")
    assert any(np.abs(weight).max() > 0 for weight, _ in network.layers[-1:])  # the last layer began with zeros
    assert cleanrl.judge(arguments, envs, name).keys() == {name, "none"}


def test_illegal_actions_are_never_drawn_and_an_action_lasts(cleanrl: Any) -> None:
    import torch

    import cps_envs

    space = cps_envs.learning_env("DisbandingAttack", 2, adapter="native").single_observation_space
    agent = cleanrl.Agent(space, [8])
    rows = torch.zeros(500, space.columns.size)
    rows[:, -2:] = 1.0  # the last two actions are legal
    drawn, likelihood = agent.draw(rows)
    assert set(drawn[:, 0].tolist()) == {space.columns.mask - 2, space.columns.mask - 1}
    torch.testing.assert_close(agent.judge(agent.distributions(rows), drawn), likelihood)
    space = cps_envs.learning_env("RogueAttack", 2).single_observation_space
    rows = torch.zeros(500, space.columns.size)
    rows[:, space.columns.scaled + 2] = 1.0  # what was done last
    drawn, _ = cleanrl.Agent(space, [8]).draw(rows)
    assert (drawn == 2).float().mean() > 0.8


@pytest.mark.slow
def test_it_learns_and_any_command_judges_it(cleanrl: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CPS_ENVS_MEETINGS", str(tmp_path / "meetings"))
    arguments = cleanrl.Args(out=str(tmp_path))
    envs, name, history = cleanrl.train(arguments)
    assert history[-1] > history[0] + 0.5
    paid = cleanrl.judge(arguments, envs, name)
    assert paid[name] > 1.2 > paid["none"] + 1.0  # m/s
    words = f"evaluate fdi attacker --attacker {name} --defender cusum --baseline none --episodes 20 --jobs 1"
    assert invoke(*words.split()).exit_code == 0
