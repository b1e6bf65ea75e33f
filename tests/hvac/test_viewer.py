from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cps_envs.core.picture.history import History
from cps_envs.core.picture.marks import Area
from cps_envs.core.picture.palette import FALSE
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.houses import house
from cps_envs.hvac.picture.belief import belief_of, clock
from cps_envs.hvac.picture.course import marked_steps, range_of, worst_zone
from cps_envs.hvac.picture.house import House
from cps_envs.hvac.picture.layout import arrange
from cps_envs.hvac.picture.palette import TEMPERATURE_SCALE, temperature_color
from cps_envs.hvac.picture.viewer import HOUSE, HvacViewer, blocked, panels
from tests.hvac.games import go, started
from tests.hvac.pictures import CONFIG, DAY, MODEL, UNDER_WAY, attacked, frame, ring

pygame = pytest.importorskip("pygame")
pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")


@pytest.mark.parametrize("zones", [2, 3, 5, 7, 11, 16])
def test_zones_on_the_ground_lie_lowest(zones: int) -> None:
    config = ring(zones)
    layout = arrange(config, 1.5)
    ground = np.isin(np.arange(1, zones + 1), config.ground_zones)
    assert layout.row[ground].min() == layout.row[~ground].max() + 1
    assert sorted(set(layout.row.tolist())) == list(range(layout.rows))


@pytest.mark.parametrize("zones", [2, 3, 5, 7, 11, 16])
def test_rooms_lie_apart_inside_the_picture(zones: int) -> None:
    rooms = np.array(House(ring(zones), HOUSE).rooms)
    left, top, right, bottom = rooms[:, 0], rooms[:, 1], rooms[:, 0] + rooms[:, 2], rooms[:, 1] + rooms[:, 3]
    assert left.min() >= HOUSE[0]
    assert top.min() >= HOUSE[1]
    assert right.max() <= HOUSE[0] + HOUSE[2] + 1e-9
    assert bottom.max() <= HOUSE[1] + HOUSE[3] + 1e-9
    clear = (left[:, None] >= right) | (right[:, None] <= left) | (top[:, None] >= bottom) | (bottom[:, None] <= top)
    assert clear[~np.eye(zones, dtype=bool)].all()


def test_doors_lie_in_the_walls() -> None:
    house = House(ring(11), HOUSE)
    for left, top, width, height in house.doors:
        ends = [(left, top), (left + width, top + height)]
        assert len({room for room in house.rooms for x, y in ends if inside(room, x, y)}) == 2


def inside(room: tuple[float, float, float, float], x: float, y: float) -> bool:
    return room[0] <= x <= room[0] + room[2] and room[1] <= y <= room[1] + room[3]


def test_the_papers_building_stands_as_in_the_paper() -> None:
    layout = arrange(CONFIG, 1.5)
    assert layout.row.tolist() == [1, 1, 0, 0]
    assert layout.begin.tolist() == [0.0, 0.5, 0.0, 0.5]
    house = House(CONFIG, HOUSE)
    assert len(house.doors) == 4
    assert house.afar == ""


def test_linked_zones_share_a_wall_and_other_links_are_told() -> None:
    links = {"link_zones": (1, 4, 4, 2, 2, 3), "link_resistance_k_per_w": (0.01, 0.01, 0.01), "ground_zones": ()}
    adjacent = arrange(replace(CONFIG, **links), 1.5).adjacent()
    assert all(adjacent[one - 1, two - 1] for one, two in ((1, 4), (4, 2), (2, 3)))
    below_two = House(ring(3), HOUSE)
    assert len(below_two.doors) == 3
    crossed = replace(CONFIG, link_zones=(1, 2, 1, 3, 1, 4, 3, 4))
    assert len(House(crossed, HOUSE).doors) == 3
    assert House(crossed, HOUSE).afar == "also linked: 1-4"


def test_sixty_four_rooms_have_a_picture_in_which_neighbours_touch() -> None:
    config = HvacConfig(**house(64))
    assert not House(config, HOUSE).afar
    generator, numbers = np.random.default_rng(0), {"temperature": 20, "estimate": 20, "measured": 20, "reading": 20}
    scene = replace(
        UNDER_WAY,
        config=config,
        **{name: low + generator.uniform(0, 10, 64) for name, low in numbers.items()},
        **dict.fromkeys(("heating", "supplied", "unknown_heat", "believed_heat", "residual"), np.ones(64)),
        mean_residual=np.ones(64),
        shift=np.zeros(64),
        reference_c=np.full(64, 25.0),
        compromised=np.arange(64) < 9,
        choice=17,
    )
    pixels = frame(scene, config)
    rooms = pixels[150:490, 20:510].reshape(-1, 3)
    colours = {tuple(color) for color in rooms.tolist()}
    assert (np.abs(rooms.astype(int) - FALSE).max(axis=1) < 8).sum() > 9 * 5  # rings of compromised sensors
    assert len({temperature_color(value, 25.0) for value in scene.temperature} & colours) > 20


def belief(step: int, choice: int) -> tuple[str, list[bool], bool]:
    scene = replace(UNDER_WAY, step=step, choice=choice)
    return tuple(belief_of(scene))  # type: ignore[return-value]


def test_belief_names_the_sensors_behind_the_estimate() -> None:
    source, believed, flawed = belief(120, 3)  # sensors 3 and 4; 1 and 2 are compromised
    assert source == "Controller follows set 3: sensors 3 and 4"
    assert list(believed) == [False, False, True, True]
    assert not flawed
    assert belief(120, 14)[0].endswith("sensors 1, 2 and 3")
    assert belief(120, 14)[2]
    assert belief(120, 0)[2]
    assert not belief(105, 0)[2]  # followed at 104, forged from 105 on
    assert belief(106, 0)[2]


def test_the_last_choice_means_all_sensors_until_the_window_is_full() -> None:
    assert all(belief(100, MODEL)[1])
    assert not any(belief(101, MODEL)[1])
    assert not any(belief(0, 0)[1])


def test_curves_hold_what_was_true_believed_and_read() -> None:
    game = started(**DAY)
    history = History(HvacViewer.moment, HvacViewer.kept, HvacViewer.most_points)
    for scene in [game.scene(0), *attacked(game, 120, 3)]:
        history.add(scene)
        history.add(scene)
    curves = history.curves()
    assert curves["step"].tolist() == list(range(121))
    for name in ("temperature", "estimate", "reading"):
        np.testing.assert_array_equal(curves[name][-1], getattr(scene, name))
    flawed = scene.flawed
    assert flawed.sum() == 11
    drawn = panels(scene, curves)[1].marks
    of_flawed, of_intact = (mark for mark in drawn if isinstance(mark, Area))
    assert len(of_intact.share) == 21  # none before step 100, when the window is full
    assert of_intact.high[-1] == scene.mean_residual[~flawed].max()
    assert np.asarray(of_flawed.low)[-1] == scene.mean_residual[flawed].min()


def test_the_worst_zone_has_the_largest_error_since_the_onset() -> None:
    temperature = np.full((120, 4), 25.0)
    temperature[:105, 0] = 40.0
    temperature[105:, 2] = 24.0
    curves = {"step": np.arange(120.0), "temperature": temperature, "reference_c": np.full((120, 4), 25.0)}
    before = {name: values[:105] for name, values in curves.items()}
    assert worst_zone(replace(UNDER_WAY, step=104), before) == 0
    assert worst_zone(replace(UNDER_WAY, step=119), curves) == 2


def test_absurd_estimates_do_not_flatten_the_temperatures() -> None:
    assert range_of(np.array([24.0, 26.0]), np.array([25.0]), CONFIG) == (23.0, 27.0)
    low, high = range_of(np.array([24.0, 45.0]), np.array([-1e6, 1e6]), CONFIG)
    assert 5.0 < low < 10.0
    assert 45.0 < high < 50.0


def test_colours_run_from_cold_to_hot_around_the_reference() -> None:
    assert temperature_color(-5.0, 25.0) == TEMPERATURE_SCALE[0]
    assert temperature_color(25.0, 25.0) == TEMPERATURE_SCALE[50]
    assert temperature_color(70.0, 25.0) == TEMPERATURE_SCALE[-1]


@pytest.mark.parametrize(
    ("steps", "step_s", "times"),
    [(720, 120.0, ["0:00", "6:00", "12:00", "18:00"]), (90, 120.0, ["0:00", "1:00", "2:00"]), (30, 2.0, ["0:00"])],
)
def test_times_below_the_curves_are_round(steps: int, step_s: float, times: list[str]) -> None:
    config = HvacConfig(num_steps=steps, step_s=step_s, window_steps=20, onset_step=25)
    assert [clock(step, config) for step in marked_steps(config)] == times


def test_drifting_heat_and_a_wrong_forecast_are_shown_beside_what_is_believed() -> None:
    game = started(preset="learning", compromised_weights=(1,))
    go(game, 0, num_steps=200)
    unfiltered = game.scene(0)
    go(game, 30, num_steps=40)
    scene = game.scene(0)
    assert np.isnan(unfiltered.believed_heat).all()
    np.testing.assert_array_equal(scene.believed_heat, game.state.filtered[0, 14, 4:])
    np.testing.assert_array_equal(scene.unknown_heat, game.state.heat[0] + game.state.heat_drift[0, 240])
    assert scene.outdoor_c - scene.forecast_c == pytest.approx(game.state.outdoor_error[0, 240])
    belief = belief_of(scene)
    assert belief.source == "Controller follows the Kalman filter of sensors 1, 2, 3 and 4"
    assert belief.believed.all()
    shown = frame(scene, game.config)
    for changed in (
        replace(scene, believed_heat=scene.believed_heat + 50.0),
        replace(scene, unknown_heat=scene.unknown_heat + 50.0),
        replace(scene, forecast_c=scene.forecast_c + 1.0),
    ):
        assert (frame(changed, game.config) != shown).any()


def test_a_filter_without_sensors_says_so() -> None:
    game = started(preset="learning")
    go(game, 0, num_steps=200)
    go(game, 31)
    belief = belief_of(game.scene(0))
    assert belief.source == "Controller follows the Kalman filter of no sensor"
    assert not belief.believed.any()


def test_the_caption_tells_of_thermostats_and_of_messages_that_do_not_arrive() -> None:
    game = started([0], **{**DAY, "thermostats": True})
    go(game, 16)
    scene = game.scene(0)
    assert belief_of(scene).source == "Thermostats follow the raw readings"
    assert blocked(scene) == ""
    assert blocked(replace(scene, denied=np.array([True, True]))) == ", no readings or commands arrive"
