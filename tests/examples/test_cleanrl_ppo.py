"""PPO of 100 lines through `gymnasium.make_vec` alone: it plays every role, and learns each of them in a CPU minute."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.interfaces.registration import class_name
from cps_envs.core.types import ROLES
from tests.agents.command_line import invoke

ROLE_NAMES = {
    f"{problem.name}-{'attack' if role == 'attacker' else 'defense'}": class_name(problem, role)
    for problem in PROBLEMS.values()
    for role in ROLES
}
MOST_LINES, SHARE, CPU_S = 100, 0.8, 60.0


@pytest.fixture
def cleanrl(monkeypatch: pytest.MonkeyPatch) -> Any:
    pytest.importorskip("torch")
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    return import_module("cleanrl_ppo")


def test_it_is_as_short_as_it_says(cleanrl: Any) -> None:
    assert len(Path(cleanrl.__file__).read_text().splitlines()) <= MOST_LINES


@pytest.mark.parametrize("role", ["RogueAttack", "FdiDefense"])
def test_an_update_of_one_agent_and_of_a_team(cleanrl: Any, role: str, tmp_path: Path) -> None:
    from cps_agents import save_network
    from cps_agents.zoo.files import load

    envs, network = cleanrl.train(role, 0.01, seed=0, num_envs=2, opponent="none")
    save_network(tmp_path / role, envs, network)
    card, kept = load(tmp_path / role / "policy.json")
    assert (card.problem, card.role, card.preset) == (envs.unwrapped.problem.name, envs.unwrapped.role, "learning")
    np.testing.assert_array_equal(kept.layers[-1][1], network[-1].bias.detach().numpy())


@pytest.mark.slow
@pytest.mark.parametrize("track", ROLE_NAMES)
def test_it_learns_every_role_from_nothing(cleanrl: Any, track: str, tmp_path: Path) -> None:
    """At least 80 % of the shipped network's score, by the mean of two seeds; hvac-attack has a score near 0: level."""
    import cps_agents

    scores: dict[str, list[float]] = {"untrained": [], "learned": []}
    for seed in (0, 1):
        for name, cpu_s in (("untrained", 0.0), ("learned", CPU_S)):
            kept = cps_agents.save_network(tmp_path / f"{name}-{seed}", *cleanrl.train(ROLE_NAMES[track], cpu_s, seed))
            scores[name].append(cps_agents.score(track, kept, split="dev").estimate.mean)
    shipped = cps_agents.score(track, f"zoo:{track}", split="dev").estimate.mean
    print(f"{track}: untrained {scores['untrained']}, learned {scores['learned']}, shipped network {shipped:.1f}")
    assert np.mean(scores["learned"]) >= min(SHARE * shipped, shipped - 5.0)


@pytest.mark.slow
def test_any_command_judges_it(cleanrl: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from cps_agents import save_network

    monkeypatch.setenv("CPS_ENVS_MEETINGS", str(tmp_path / "meetings"))
    name = save_network(tmp_path / "mine", *cleanrl.train("FdiAttack", 1.0, seed=0))
    words = f"evaluate fdi attacker --attacker {name} --defender cusum --baseline none --episodes 20 --jobs 1"
    assert invoke(*words.split()).exit_code == 0
