"""Every registered policy plays: short episodes, in a configuration that the policy is made for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from cps_envs import PROBLEMS
from cps_envs.core.lookup import NEED_OPTIONS, policy_names
from cps_envs.core.types import ROLES, Role
from tests.episodes import play
from tests.settings import tests_of as settings_of

RIVALS = {  # whom the others meet
    "disbanding": {"attacker": "lead", "defender": "none"},
    "fdi": {"attacker": "bang_bang", "defender": "none"},
    "hvac": {"attacker": "constant", "defender": "mtd2"},
    "rogue": {"attacker": "none", "defender": "none"},
}
NOBODY = {"attacker": "none", "defender": "none"}
OPTIONS = {"plan": "plan?events=[[4,2]]", "ga": "ga?generations=2&population=6"}
# Of false data injection, where readings are exact.
EXACT = {"none", "bnb", "lp_greedy", "oracle", "shielded", "kinematic", "redundancy", "model"}
# Who need a configuration that offers filters.
CHOOSE_FILTERS = {"bayes", "cusum", "largest", "informed", "tracker", "warm_tracker", "listener"}


def settings(problem: str, role: Role, name: str) -> list[dict[str, Any]]:
    """The configurations, and their preset, that a policy plays in."""
    if problem not in RIVALS:
        return [dict(settings_of(problem).short)]
    if problem == "disbanding":
        return [{"duration_s": 5.0, "num_platoons": 4, "attack_budget": 2}]
    if problem == "fdi":
        if name == "annealing":
            return [{"preset": "drawn"}]
        exact = {"attacker": "paper", "defender": "clip"}[role]
        return [{"preset": exact if name in EXACT else "learning"}]
    if problem == "hvac":
        filters = {"kalman_filters": name in CHOOSE_FILTERS}
        return [{"num_steps": 230, "num_sensors": sensors, **filters} for sensors in (4, 8)]
    if name == "box_in":
        return [{"preset": "easy", "duration_s": 2.0, "onset_s": 0.0, "defense_action": "command"}]
    # Those who give orders to all vehicles need the seat hidden.
    presets = ("learning",) if name in ("escort", "guard", "monitor") else ("easy", "learning")
    return [{"preset": preset, "duration_s": 2.0, "onset_s": 0.0} for preset in presets]


def cases() -> Iterator[tuple[str, Role, str]]:
    for problem in PROBLEMS:
        for role in ROLES if problem != "rogue" else ("defender",):  # its attackers: tests/rogue
            for name in sorted(
                set(policy_names(problem, role)) - {*NEED_OPTIONS} | {*OPTIONS} & {*policy_names(problem, role)}
            ):
                yield problem, role, name


@pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows
@pytest.mark.parametrize(("problem", "role", "name"), list(cases()))
def test_every_registered_policy_plays(problem: str, role: Role, name: str) -> None:
    players = RIVALS.get(problem, NOBODY) | {role: OPTIONS.get(name, name)}
    for overrides in settings(problem, role, name):
        assert np.isfinite(play(PROBLEMS[problem], **players, seeds=range(3), **overrides)["return"]).all()
