"""A defender that gives way to whom the monitor suspects: it plays as the monitor before, and lets less pass after."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.families import ESCORT
from cps_baselines.rogue.guard import Guard
from cps_baselines.rogue.monitor import NOBODY
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.lookup import resolve_policy
from cps_envs.core.policy import RoleSpec, State
from cps_envs.core.seen import Seen
from cps_envs.core.types import Array
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.problem import ROGUE
from tests.episodes import play, spec_of

EPISODES = range(660_000, 660_080)


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


@pytest.mark.parametrize("attacker", ["contested?against=sliding", "square?frequency_hz=0.1"])
def test_it_does_not_suspect_vehicles_that_obey_its_own_commands(attacker: str) -> None:
    """A commanded vehicle shows no law: who takes it for a linear one suspects somebody else a third of the time."""
    guard = Watched(spec_of(ROGUE, "defender", "learning", attack_share=1.0))
    wrong = 0
    for seed in EPISODES[:4]:
        guard.seen.clear()
        play(ROGUE, attacker, guard, [seed], "learning", attack_share=1.0, attacker_index=2)
        wrong += sum(seat not in (NOBODY, 1) for seat, _ in guard.seen)
    assert wrong < 0.02 * 4 * len(guard.seen)


class Watched(Guard):
    """Keeps whom the monitor suspects in the first episode, and what the vehicles are ordered."""

    def __init__(self, spec: RoleSpec) -> None:
        super().__init__(spec, ESCORT.row({}), threshold_mps=2.0, slack_mps2=2.0)
        self.seen: list[tuple[int, Array]] = []

    def act(self, seen: Seen, state: State) -> tuple[Array, State]:
        orders, state = super().act(seen, state)
        assert state is not None
        self.seen.append((int(state[1][0]), orders[0, ::2]))
        return orders, state


def test_the_vehicle_ahead_of_a_suspect_is_ordered_accelerations_and_those_behind_it_controllers() -> None:
    guard = Watched(spec_of(ROGUE, "defender", "learning", attack_share=1.0))
    play(ROGUE, "always?action=1", guard, EPISODES[:1], "learning", attack_share=1.0)
    found = [(seat, laws) for seat, laws in guard.seen if seat != NOBODY]
    assert len(found) > 50
    assert any(laws[seat + 1] >= len(CONTROLLERS) for seat, laws in found if seat + 1 < len(laws))
    assert all(laws[: seat + 1].max() < len(CONTROLLERS) for seat, laws in found)


def test_its_numbers_are_options_and_it_needs_accelerations() -> None:
    spec = spec_of(ROGUE, "defender", "learning")
    assert not resolve_policy("guard?near_m=5.0&threshold_mps=2.0", spec).privileged
    with pytest.raises(ConfigurationError, match='needs defense_action="either"'):
        resolve_policy("guard", spec_of(ROGUE, "defender", "paper"))
