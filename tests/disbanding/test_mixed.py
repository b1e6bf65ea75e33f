"""Strings of vehicles that differ: trucks among cars."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.compute.kernels import unpack, view
from cps_envs.core.errors import ConfigurationError
from cps_envs.disbanding.dynamics import integrate
from cps_envs.disbanding.problem import DISBANDING
from cps_envs.disbanding.state import Constants
from tests import episodes

SMALL = {"num_platoons": 2, "vehicles_per_platoon": 3}
EVERYONE = np.ones(1, bool)


def started(preset: str = "paper", **changes: Any) -> Any:
    return episodes.started(DISBANDING, (0,), preset, **{**SMALL, **changes})


def moved(game: Any, steps: int = 100) -> Any:
    game.advance({"attacker": np.array([2])}, EVERYONE, steps)  # the platoon in front is disbanded
    return game.state


@pytest.mark.parametrize("interpretation", ["S0", "S2"])
def test_vehicles_named_one_by_one_that_are_alike_move_as_ever(interpretation: str) -> None:
    values = {"tau_s": 0.3, "proportional_gain": 1.0, "derivative_gain": 5.0}
    one = moved(started(interpretation=interpretation, **values))
    each = moved(started(interpretation=interpretation, **{name: [value] * 6 for name, value in values.items()}))
    for name in ("position", "speed", "acceleration", "command", "speed_error"):
        np.testing.assert_array_equal(getattr(one, name), getattr(each, name))


@pytest.mark.parametrize("interpretation", ["S0", "S2"])
def test_each_vehicle_lags_by_its_own_time(interpretation: str) -> None:
    tau_s = np.array([0.1, 0.2, 0.5, 0.1, 0.3, 0.4])
    game = started(interpretation=interpretation, tau_s=tau_s)
    assert game.constants["tau_s"] == pytest.approx(tau_s.mean())
    episode, dt = view(game.state, 0), game.config.dynamics.dt_s
    episode.command[:] = 0.5
    integrate(episode, unpack(Constants, game.constants, 0))
    share = 1 - np.exp(-dt / tau_s) if interpretation == "S2" else dt / tau_s
    assert episode.acceleration == pytest.approx(share * 0.5)


def test_gains_are_of_each_vehicle() -> None:
    game = started(proportional_gain=[1, 2, 3, 1, 1, 1], derivative_gain=[5, 5, 0, 5, 5, 5])
    game.state.position[0, 1:] -= 0.25  # the first gap is wider, and the others as they were
    game.advance({}, EVERYONE, 1)
    reference = started()
    reference.state.position[0, 1:] -= 0.25
    reference.advance({}, EVERYONE, 1)
    assert game.state.command[0, 1] > 1.5 * reference.state.command[0, 1] > 0
    assert game.state.command[0, 0] == pytest.approx(reference.state.command[0, 0])


def test_pairs_are_drawn_for_all_or_for_each() -> None:
    def drawn(**changes: Any) -> Any:
        return episodes.started(DISBANDING, range(32), "learning", **{**SMALL, "attack_budget": 2, **changes})

    plain, shared = drawn(), drawn(proportional_gain=(0.5, 1.5))
    each = drawn(tau_s=((0.1, 0.5), 0.2, (0.1, 0.5), 0.2, 0.2, 0.2))
    assert np.ptp(shared.constants["proportional_gain"]) > 0.5
    assert shared.state.proportional_gain.shape == (32, 0)
    assert (each.state.tau_s[:, 1] == 0.2).all()
    assert (np.ptp(each.state.tau_s[:, [0, 2]], axis=0) > 0.2).all()
    assert each.constants["tau_s"] == pytest.approx(each.state.tau_s.mean(axis=1))
    for found in (shared, each):  # nothing else of the string is drawn otherwise
        np.testing.assert_array_equal(found.state.speed, plain.state.speed)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"tau_s": [0.1] * 5}, "tau_s has 5 values for 6 vehicles"),
        ({"tau_s": [[0.1, 0.1], [0.5, 0.5]]}, "tau_s has 2 values for 6 vehicles.*a draw"),
        ({"tau_s": [0.1] * 5 + [0.001]}, "tau_s = 0.001 is outside"),
        ({"tau_s": [0.3] * 5 + [0.01], "interpretation": "S1"}, "shorter than the integration step"),
    ],
)
def test_impossible_strings_are_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        DISBANDING.config("paper", {**SMALL, **change})
