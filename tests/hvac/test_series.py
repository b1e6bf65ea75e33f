"""Weather, set-points and internal heat as series, a value for each zone, and plants that cool."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_envs.core.compute.generators import seeded
from cps_envs.core.declare.seeds import TRAINING_START
from cps_envs.core.declare.series import Series
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.types import Array
from cps_envs.hvac.building import discretise
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.problem import HVAC
from cps_envs.hvac.teams import Believers
from tests.hvac.games import QUIET, go, seen, started

DAY_S = 86_400.0
HOURS = 24 * 28
OUTDOOR = Series(10.0 + 5.0 * np.sin(np.arange(HOURS) / 7.0), 3600.0)
GROUND = Series(np.linspace(5.0, 9.0, 28), DAY_S)
HEAT = Series(np.arange(HOURS)[:, np.newaxis] % 24 * np.array([1.0, 2.0, 0.0, 4.0]), 3600.0)
NIGHT = Series([18.0] * 6 + [21.0] * 16 + [18.0] * 2, 3600.0, repeats=True)
SERIES: dict[str, Any] = {"outdoor_c": OUTDOOR, "ground_c": GROUND, "internal_heat_w": HEAT, "reference_c": NIGHT}
BRIEF: dict[str, Any] = {"num_steps": 90, "window_steps": 40, "onset_step": 45, "initial_c": 20.0, **QUIET}


def begun(seeds: tuple[int, ...] = (3,), **changes: Any) -> HvacGame:
    game = HvacGame(HVAC.config("paper", {**BRIEF, **SERIES, **changes}), len(seeds))
    game.reset(np.ones(len(seeds), np.bool_), seeded(seeds))
    return game


def hour_of(game: HvacGame, k: int) -> float:
    return float(game.state.first[0] + k) * 120.0 / 3600.0


def test_the_plant_meets_the_series_at_the_place_where_its_day_begins() -> None:
    game, house = begun(), discretise(HVAC.config("paper", {}))
    assert game.state.first[0] % 720 == 0
    for k in range(60):
        before, heating = game.state.temperature[0].copy(), 0.0
        go(game, 0)
        hour = hour_of(game, k)
        outside = 10.0 + np.interp(hour, np.arange(HOURS), 5.0 * np.sin(np.arange(HOURS) / 7.0))
        ground = np.interp(hour / 24.0, np.arange(28), np.linspace(5.0, 9.0, 28))
        heating = game.state.heating[0] + int(hour) % 24 * np.array([1.0, 2.0, 0.0, 4.0])
        after = house.A @ before + house.B * heating + house.G * np.array([ground, ground, outside, outside])
        np.testing.assert_allclose(game.state.temperature[0], after, rtol=1e-12)


def test_days_are_those_of_the_half_of_a_seed() -> None:
    learned = {int(each) // 720 for each in begun(tuple(range(TRAINING_START, TRAINING_START + 200))).state.first}
    judged = {int(each) // 720 for each in begun(tuple(range(200))).state.first}
    assert learned == {*range(7), *range(14, 21)}
    assert judged == {*range(7, 14), *range(21, 27)}
    named = {int(each) // 720 for each in begun(tuple(range(100)), series_split="train").state.first}
    assert named <= learned


def test_an_episode_follows_from_its_seed_in_a_batch_too() -> None:
    batch, alone = begun((5, 6, 7)), begun((7,))
    for _ in range(50):
        go(batch, 3)
        go(alone, 3)
    assert batch.state.first[2] == alone.state.first[0]
    assert (batch.state.temperature[2] == alone.state.temperature[0]).all()


def test_one_number_is_what_it_was() -> None:
    """A series that stays is bit for bit the number."""
    same = {"outdoor_c": 23.0, "outdoor_mean_c": 23.0, "outdoor_swing_c": 0.0}
    plain = started([4], num_steps=90, window_steps=40, onset_step=45, outdoor_swing_c=0.0)
    other = HvacGame(
        HVAC.config("paper", {"num_steps": 90, "window_steps": 40, "onset_step": 45, **same,
                              "reference_c": Series([25.0, 25.0], 60, repeats=True),
                              "ground_c": Series([23.5, 23.5], 60, repeats=True), "max_heating_w": (1000.0,) * 4}), 1
    )  # fmt: skip
    other.reset(np.ones(1, np.bool_), [np.random.default_rng(4)])
    for k in range(60):
        go(plain, 0 if k < 40 else 3)
        go(other, 0 if k < 40 else 3)
    assert plain.state.temperature.tobytes() == other.state.temperature.tobytes()
    assert plain.state.first[0] == other.state.first[0] == 0


def test_the_error_is_from_the_set_point_of_the_moment() -> None:
    game, paid, errors = begun(onset_step=0), 0.0, []
    for k in range(89):
        errors.append(game.state.temperature[0] - np.where(6 <= hour_of(game, k) % 24 < 22, 21.0, 18.0))
        paid += float(go(game, 0)[0])
    errors.append(game.state.temperature[0] - 18.0)  # 3 o'clock
    assert paid == pytest.approx((np.array(errors) ** 2).sum() / 90)
    np.testing.assert_allclose(game.metrics()["a_impact"][0], paid)
    team = game.team("defender")
    assert isinstance(team, Believers)
    np.testing.assert_allclose(team._errors()[0], errors[-1])


def test_zones_have_set_points_of_their_own() -> None:
    wanted = (18.0, 20.0, 22.0, 24.0)
    game = begun(reference_c=wanted, min_heating_w=-1000.0, num_steps=720, window_steps=200)
    for _ in range(700):
        go(game, 0)
    assert game.state.temperature[0] == pytest.approx(wanted, abs=0.4)


def test_a_plan_prepares_for_the_set_points_to_come() -> None:
    """Without a limit in reach it is the gains with what set-points to come change, step by step."""
    wide = {"max_heating_w": 1e4, "min_heating_w": -1e4, "num_levels": 1_000_000}
    wide |= {"prediction_steps": 30, "move_weight": 1e-4}
    morning = {**BRIEF, **SERIES, **wide, "reference_c": Series([18.0, 21.0], 4 * 3600.0, repeats=True)}
    games = []
    for controller in ("clip", "qp"):
        game = HvacGame(HVAC.config("paper", {**morning, "num_steps": 300, "controller": controller}), 1)
        game.reset(np.ones(1, np.bool_), seeded((3,)))
        games.append(game)
    temperatures = []
    for _ in range(200):
        for game in games:
            go(game, 0)
        temperatures.append([game.state.temperature[0].copy() for game in games])
    clip, planned = np.array(temperatures).swapaxes(0, 1)
    np.testing.assert_allclose(clip, planned, atol=2e-3)
    assert games[0].state.first[0] % 720 == 0
    assert clip[119].mean() > clip[90].mean() + 0.1  # the step comes at 120
    assert clip[-1] == pytest.approx([21.0] * 4, abs=0.3)


def test_a_plant_cools_where_it_may() -> None:
    hot: dict[str, Any] = {"outdoor_c": 33.0, "ground_c": 30.0, "internal_heat_w": (50.0, 0.0, 0.0, 80.0)}
    day = {**BRIEF, "num_steps": 720, "window_steps": 200, "onset_step": 1, **hot}
    ends, kwh = [], []
    for least in (0.0, (-500.0, -500.0, -500.0, -10.0)):
        game = HvacGame(HVAC.config("paper", {**day, "min_heating_w": least}), 1)
        game.reset(np.ones(1, np.bool_), seeded((3,)))
        powers = []
        for _ in range(719):
            go(game, 0)
            powers.append(game.state.heating[0].copy())
        ends.append(game.state.temperature[0].copy())
        kwh.append(float(game.metrics()["energy_kwh"][0]))
        assert np.abs(powers).sum() * 120.0 / 3.6e6 == pytest.approx(kwh[-1])
    assert ends[0].min() > 31.0
    assert ends[1][:3] == pytest.approx([25.0] * 3, abs=1.0)
    assert ends[1][3] > 26.0
    assert np.min(powers, axis=0)[3] == -10.0


def test_sensors_have_noise_and_ranges_of_their_own() -> None:
    own = {"noise_std_c": (0.0, 0.1, 0.2, 2.0), "sensor_low_c": (10.0, 0.0, 10.0, 10.0), "num_compromised": 1}
    game = HvacGame(HVAC.config("paper", {**own, "num_steps": 400, "attack_order": (2,), "onset_step": 1}), 1)
    game.reset(np.ones(1, np.bool_), seeded((3,)))
    noise = []
    for _ in range(300):
        go(game, 0, [-1.0, -1.0, -1.0, -1.0, 1.0])
        noise.append(game.state.measured[0] - game.state.temperature[0])
        assert game.state.reading[0, 1] == 0.0
    assert np.std(noise, axis=0) == pytest.approx([0.0, 0.1, 0.2, 2.0], rel=0.2)


def test_both_roles_see_the_set_points_and_the_defender_what_is_behind_the_walls() -> None:
    game = begun()
    for _ in range(30):
        go(game, 0)
    for role in ("attacker", "defender"):
        assert seen(game, role)["reference_c"][0] == pytest.approx([18.0] * 4, abs=1e-5)  # type: ignore[arg-type]
    k = int(game.state.first[0]) + 29
    assert seen(game, "defender")["wall_c"][0] == pytest.approx(game.constants.weather[k], abs=1e-4)
    assert seen(game, "defender")["outdoor_c"][0, 0] == pytest.approx(game.constants.outdoor[k + 1], abs=1e-4)


def course(policy: str, preset: str = "learning") -> Array:
    config = HVAC.config(preset, {**SERIES, "initial_c": 20.0, "num_steps": 260, "onset_step": 210})
    match = HVAC.match(config, 2, {"defender": policy})
    match.reset(np.ones(2, np.bool_), seeded((1, 2)))
    for _ in range(240):
        match.step({}, np.ones(2, np.bool_), 1)
    temperature: Array = match.game.state.temperature  # type: ignore[attr-defined]
    return temperature


def test_policies_that_know_the_building_know_its_weather() -> None:
    assert np.abs(course("bayes") - course("largest")).max() < 1.0


def test_a_file_fills_the_fields(tmp_path: Path) -> None:
    path = tmp_path / "house.csv"
    rows = [f"{3600 * hour},{hour % 24},{8 + hour % 3},1,2,3,4" for hour in range(72)]
    names = "time_s,outdoor_c,ground_c," + ",".join(f"internal_heat_w_{zone}" for zone in (1, 2, 3, 4))
    path.write_text("\n".join([names, *rows]))
    config = HVAC.config("learning", {"traces": str(path), "series_split": "all"})
    assert config.outdoor_c.values[30, 0] == 6.0
    assert config.internal_heat_w.values.tolist() == [[1, 2, 3, 4]] * 72
    with pytest.raises(ConfigurationError, match=r"house.csv: no episode of 29.97 h.*series_split=\"all\""):
        HVAC.config("learning", {"traces": str(path)})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"reference_c": (20.0, 21.0)}, "reference_c has 2 values for 4 zones"),
        ({"reference_c": Series([20, 55], 60, repeats=True)}, "widen sensor_low_c"),
        ({"outdoor_c": Series(np.zeros((99, 2)), 3600)}, "outdoor_c has 2 values at a time"),
        ({"outdoor_c": Series(np.zeros(20), 3600)}, "there are 19 h"),
        ({"noise_std_c": (0.1,) * 3}, "noise_std_c has 3 values for 4 sensors"),
        ({"min_heating_w": 5.0}, r"outside \[-1e\+09, 0\] W"),
        ({"sensor_low_c": (10.0, 41.0, 10.0, 10.0)}, "below sensor_high_c"),
        ({"series_split": "half"}, "is not one of seed, all, train, test"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        HVAC.config("paper", change)
