"""The networks that ship: each loads, plays, and is better than doing nothing and than the best constant action."""

from __future__ import annotations

from typing import Any

import pytest

from cps_agents.zoo.card import read_card
from cps_agents.zoo.files import find
from cps_agents.zoo.markdown import to_markdown
from cps_envs.core.game.play import play_episodes
from cps_envs.core.types import SIGN, Role, other
from cps_envs.registration import find_problem

CASES: dict[str, tuple[Role, str, str]] = {  # role, opponent, best constant
    "rogue-attack": ("attacker", "monitor", "always?action=-1.0"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_shipped_network_is_better_than_no_thought(name: str) -> None:
    role, opponent, constant = CASES[name]
    problem = find_problem(name.partition("-")[0])

    def worth(policy: str) -> float:
        players: dict[Role, Any] = {role: policy, other(role): opponent}
        paid = play_episodes(problem, problem.config("learning", {}), players, range(24))["return"]
        return SIGN[role] * float(paid.mean())

    assert worth(f"zoo:{name}") > max(worth("none"), worth(constant)) + 1.0


@pytest.mark.parametrize(
    ("name", "began"),
    [("hvac-defense", True), ("rogue-defense", True), ("fdi-attack", False), ("disbanding-attack", False)],
)
def test_a_card_says_whether_learning_began_as_a_controller_plays(name: str, began: bool) -> None:
    assert ("learning began there" in to_markdown(read_card(find(name)))) == began
