"""Every registered policy plays: short episodes, in presets that it fits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import NEED_OPTIONS, policy_names
from cps_envs.core.types import ROLES, Array, Role
from tests.episodes import play
from tests.settings import tests_of as settings_of

RIVALS = {  # whom the others meet
    "disbanding": {"attacker": "lead", "defender": "none"},
    "fdi": {"attacker": "bang_bang", "defender": "none"},
    "hvac": {"attacker": "constant", "defender": "mtd2"},
}
NOBODY = {"attacker": "none", "defender": "none"}
OPTIONS = {"plan": "plan?events=[[4,2]]", "ga": "ga?generations=2&population=6"}
POWERS = {"command_attack_w": 300.0, "denial": ("readings", "commands")}  # which some attackers of hvac need
SHORT: Mapping[str, list[dict[str, Any]]] = {
    "disbanding": [{"duration_s": 5.0, "num_platoons": 4, "attack_budget": 2}],
    "fdi": [{}],
    "hvac": [{"num_steps": 230, "num_sensors": sensors, "kalman_filters": True, **POWERS} for sensors in (4, 8)],
    "rogue": [{"duration_s": 2.0, "onset_s": 0.0}],
}


def cases() -> Iterator[tuple[str, Role, str]]:
    for problem in PROBLEMS:
        for role in ROLES:
            for name in policy_names(problem, role):
                if name in OPTIONS or name not in NEED_OPTIONS:
                    yield problem, role, name


def paid(problem: str, players: Mapping[str, Any], preset: str, overrides: Mapping[str, Any]) -> Array | None:
    """What the attacker is paid in three episodes; None if a policy does not fit the configuration."""
    try:
        return play(PROBLEMS[problem], **players, seeds=range(3), preset=preset, **overrides)["return"]
    except ConfigurationError:
        return None


@pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
@pytest.mark.parametrize(("problem", "role", "name"), list(cases()))
def test_every_registered_policy_plays(problem: str, role: Role, name: str) -> None:
    """In the first preset that it fits, and in preset `learning` if it fits that."""
    players = {**RIVALS.get(problem, NOBODY), role: OPTIONS.get(name, name)}
    for short in SHORT.get(problem, [settings_of(problem).short]):
        tried = (paid(problem, players, preset, short) for preset in PROBLEMS[problem].presets)
        found = next((each for each in tried if each is not None), None)
        assert found is not None, "it fits no preset"
        learning = paid(problem, players, "learning", short)
        assert all(np.isfinite(each).all() for each in (found, learning) if each is not None)
