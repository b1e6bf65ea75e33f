"""Attacks on commands, set-points and messages, and the thermostats that hear none of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_envs.core.errors import ConfigurationError
from cps_envs.hvac.attack import absolute_action, bias_action, with_powers
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.powers import ABSENT, powers_of
from tests.hvac.games import QUIET, SHORT, go, seen, started

ALL = {"command_attack_w": 300.0, "reference_attack_c": 2.0, "denial": ("readings", "commands")}
COLD = {"outdoor_mean_c": 5.0, "ground_c": 10.0}
THERMOSTATS = 16  # the choice, where no filters are offered


def action(game: HvacGame, **shares: Any) -> Any:
    return with_powers(game.config, bias_action(game.config, np.zeros((1, 4)), keep_noise=True), **shares)[0]


def begun(num_steps: int = 50, **config: Any) -> HvacGame:
    """A cold day on which the attack has begun, and nothing else was done."""
    game: HvacGame = started([0], **{**SHORT, **COLD, **ALL, "num_compromised": 1, **config})
    go(game, num_steps=num_steps)
    return game


def test_an_action_has_an_entry_for_each_power() -> None:
    assert powers_of(HvacConfig()) == (4, ABSENT, ABSENT, ABSENT, ABSENT, 5)
    assert powers_of(HvacConfig(**ALL)) == (4, 5, 9, 13, 14, 15)  # type: ignore[arg-type]
    config = HvacConfig(attack_action="bias", denial=("commands",), reference_attack_c=(0.0, 1.0, 0.0, 0.0))
    assert powers_of(config) == (ABSENT, ABSENT, 4, ABSENT, 8, 9)
    assert started(**ALL).action_space["attacker"].shape == (15,)


def test_columns_name_the_entries_in_units() -> None:
    columns = started(**ALL).columns("attacker")
    assert len(columns) == 15
    assert [column.name for column in columns[4:7]] == ["base", "command_w_1", "command_w_2"]
    assert columns[5].values(np.array([-0.5])) == pytest.approx([-150.0])
    assert columns[9].values(np.array([1.0])) == pytest.approx([2.0])
    assert [column.name for column in columns[13:]] == ["deny_readings", "deny_commands"]


def test_a_power_that_is_not_given_cannot_be_used() -> None:
    with pytest.raises(ConfigurationError, match="no power over commands here: set command_attack_w"):
        action(started(), commands=1.0)


def test_powers_that_rest_change_nothing() -> None:
    plain, able = started([3], **SHORT), started([3], **{**SHORT, **ALL, "thermostats": True})
    for game in (plain, able):
        go(game, attack=absolute_action(game.config, np.full((1, 4), 22.0))[0], num_steps=89)
    np.testing.assert_array_equal(plain.state.temperature, able.state.temperature)
    assert plain.metrics()["energy_kwh"] == able.metrics()["energy_kwh"]


def test_commands_reach_the_zones_with_what_the_attacker_adds() -> None:
    game = begun()
    x, w = game.state.temperature[0].copy(), game.constants.weather[50]
    go(game, attack=action(game, commands=np.array([1.0, -1.0, 0.5, 0.0])))
    heating, supplied = game.state.heating[0], game.state.supplied[0]
    np.testing.assert_allclose(supplied, np.clip(heating + np.array([300.0, -300.0, 150.0, 0.0]), 0, 1000))
    assert supplied[3] == heating[3] > 0
    m = game.constants
    np.testing.assert_allclose(game.state.temperature[0], m.A @ x + m.B * supplied + m.G * w)
    assert game.metrics()["attack_kwh"][0] == pytest.approx(game.state.energy_j[0] / 3.6e6 - energy_before(game))


def energy_before(game: HvacGame) -> float:
    """KWh until the onset."""
    same = started([0], **{**SHORT, **COLD, **ALL, "num_compromised": 1})
    go(same, num_steps=45)
    return float(same.state.energy_j[0] / 3.6e6)


def test_the_control_loop_believes_its_own_commands() -> None:
    game = begun(**QUIET)
    forced, w = game.state.forced[0].copy(), game.constants.weather[50]
    go(game, attack=action(game, commands=1.0))
    m = game.constants
    np.testing.assert_allclose(game.state.forced[0], m.A @ forced + m.B * game.state.heating[0] + m.G * w)
    np.testing.assert_allclose(seen(game, "defender")["heating"][0], game.state.heating[0], atol=1e-3)


@pytest.mark.parametrize("controller", ["clip", "qp", "levels", "on_off"])
def test_a_controller_goes_for_the_set_points_that_it_is_told(controller: str) -> None:
    day = {**SHORT, **COLD, "onset_step": 0, "controller": controller, "prediction_steps": 20}
    told = started([0], **day, reference_attack_c=(2.0, 2.0, 4.0, 0.0))
    asked = started([0], **day, reference_c=(26.0, 25.0, 23.0, 25.0))
    go(told, attack=action(told, references=np.array([0.5, 0.0, -0.5, 1.0])), num_steps=60)
    go(asked, num_steps=60)
    np.testing.assert_array_equal(told.state.shift[0], [1.0, 0.0, -2.0, 0.0])
    np.testing.assert_array_equal(told.state.heating, asked.state.heating)
    np.testing.assert_array_equal(told.state.temperature, asked.state.temperature)


def test_the_payoff_counts_from_the_true_set_point() -> None:
    game = begun(**QUIET)
    paid = go(game, attack=action(game, references=1.0))
    assert paid[0] == pytest.approx(((game.state.temperature[0] - 25.0) ** 2).sum() / 45)


def test_without_commands_the_last_heating_stays() -> None:
    game = begun()
    supplied = game.state.supplied[0].copy()
    heating = []
    for _ in range(5):
        go(game, attack=action(game, deny_commands=1.0))
        np.testing.assert_array_equal(game.state.supplied[0], supplied)
        assert game.state.denied[0].tolist() == [False, True]
        heating.append(game.state.heating[0].copy())
    assert np.ptp(heating, axis=0).max() > 0
    go(game)
    np.testing.assert_array_equal(game.state.supplied, game.state.heating)


def test_without_readings_the_last_ones_stay() -> None:
    game = begun()
    reading = game.state.reading[0].copy()
    for _ in range(5):
        go(game, attack=action(game, deny_readings=1.0))
        np.testing.assert_array_equal(game.state.reading[0], reading)
        assert (game.state.measured[0] != reading).all()
        assert game.state.denied[0].tolist() == [True, False]
    go(game)
    np.testing.assert_array_equal(game.state.reading, game.state.measured)


def test_nothing_begins_before_the_onset() -> None:
    quiet, eager = begun(40), begun(40)
    go(eager, attack=action(eager, commands=1.0, references=1.0, deny_commands=1.0), num_steps=5)
    go(quiet, num_steps=5)
    np.testing.assert_array_equal(quiet.state.temperature, eager.state.temperature)
    go(eager, attack=action(eager, commands=1.0))
    go(quiet)
    assert (quiet.state.temperature < eager.state.temperature).all()


def test_thermostats_hear_no_commands_and_no_set_points() -> None:
    attacked, left = begun(thermostats=True, hysteresis_c=0.3), begun(thermostats=True, hysteresis_c=0.3)
    all_of_it = action(attacked, commands=1.0, references=1.0, deny_commands=1.0)
    before = attacked.state.heating[0].copy()
    for _ in range(30):
        reading = attacked.state.reading[0].copy()
        go(attacked, THERMOSTATS, all_of_it)
        go(left, THERMOSTATS)
        before = np.where(reading < 24.7, 1000.0, np.where(reading > 25.3, 0.0, before))
        np.testing.assert_array_equal(attacked.state.supplied[0], before)
    np.testing.assert_array_equal(attacked.state.temperature, left.state.temperature)
    assert len({*before.tolist()} - {0.0, 1000.0}) == 0


def test_the_controller_waits_while_thermostats_heat() -> None:
    game = begun(thermostats=True)
    integrator = game.state.integrator[0].copy()
    go(game, THERMOSTATS, num_steps=5)
    np.testing.assert_array_equal(game.state.integrator[0], integrator)
    assert game.metrics()["distinct_sets"][0] == game.metrics()["model_steps"][0] == 0


def test_thermostats_can_heat_before_the_window_is_full() -> None:
    game = started([0], **{**SHORT, **COLD, "thermostats": True})
    assert game.episode_mask("defender", 0).tolist() == [1] + [0] * 14 + [1, 1]  # type: ignore[union-attr]
    go(game, THERMOSTATS)
    assert game.state.heating[0].max() == 1000.0
    assert seen(game, "defender")["last_choice"][0].argmax() == THERMOSTATS
