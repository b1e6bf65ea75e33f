"""A defender that gives way to whom the monitor suspects: it plays as the monitor before, and lets less pass after."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.families import ESCORT
from cps_baselines.rogue.guard import Guard
from cps_baselines.rogue.monitor import NOBODY
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import Array
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.problem import ROGUE
from tests.episodes import noted, play, spec_of

EPISODES = range(660_000, 660_040)


def paid(attacker: str, defender: str, **overrides: Any) -> Array:
    return play(ROGUE, attacker, defender, EPISODES, "learning", **overrides)["return"]


@pytest.mark.parametrize("attacker", ["contested?against=monitor", "contested?against=assigned"])
def test_it_lets_less_pass_than_the_monitor_does(attacker: str) -> None:
    assert np.mean(paid(attacker, "monitor") - paid(attacker, "guard")) > 1.0


def test_without_an_attack_it_is_the_monitor_and_suspects_hardly_anybody() -> None:
    calm, monitor = {"attack_share": 0.0}, "guard?threshold_mps=4.0&slack_mps2=3.0"
    quiet = paid("none", "monitor", **calm)
    np.testing.assert_array_equal(paid("none", monitor, **calm), quiet)
    assert np.mean(paid("none", "guard", **calm) - quiet) < 0.05


def guarded(attacker: str, seed: int, **overrides: Any) -> list[tuple[int, Array]]:
    """At each decision of an episode with an attack: whom the guard suspects, and the laws that it orders."""
    guard = Guard(spec_of(ROGUE, "defender", "learning"), ESCORT.row({}), threshold_mps=2.0, slack_mps2=2.0)
    found = noted(guard, lambda seen, orders, state: (int(state[1][0]), orders[0, ::2]))
    play(ROGUE, attacker, guard, [seed], "learning", attack_share=1.0, **overrides)
    return found


@pytest.mark.parametrize("attacker", ["contested?against=sliding", "square?frequency_hz=0.1"])
def test_it_does_not_suspect_vehicles_that_obey_its_own_commands(attacker: str) -> None:
    """A commanded vehicle shows no law: who takes it for a linear one suspects somebody else a third of the time."""
    found = [seat for seed in EPISODES[:4] for seat, _ in guarded(attacker, seed, attacker_index=2)]
    assert np.mean([seat not in (NOBODY, 1) for seat in found]) < 0.02


def test_the_vehicle_ahead_of_a_suspect_is_ordered_accelerations_and_those_behind_it_controllers() -> None:
    found = [(seat, laws) for seat, laws in guarded("always?action=1", EPISODES[0]) if seat != NOBODY]
    assert len(found) > 50
    assert any(laws[seat + 1] >= len(CONTROLLERS) for seat, laws in found if seat + 1 < len(laws))
    assert all(laws[: seat + 1].max() < len(CONTROLLERS) for seat, laws in found)


def test_its_numbers_are_options_and_it_needs_accelerations() -> None:
    spec = spec_of(ROGUE, "defender", "learning")
    assert not resolve_policy("guard?near_m=5.0&threshold_mps=2.0", spec).privileged
    with pytest.raises(ConfigurationError, match='needs defense_action="either"'):
        resolve_policy("guard", spec_of(ROGUE, "defender", "paper"))
