"""The networks that ship: each loads, plays, and is better than doing nothing and than the best constant action."""

from __future__ import annotations

from typing import Any

import pytest

from cps_envs.core.play import play_episodes
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
