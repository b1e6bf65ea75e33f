from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

from cps_envs.core.errors import MissingExtraError
from cps_envs.core.picture.history import History
from cps_envs.core.picture.plot import Plot
from cps_envs.core.types import Array
from cps_envs.hvac.attack import absolute_action
from cps_envs.hvac.config import HvacConfig
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.picture.belief import belief_of, clock, flawed_sets
from cps_envs.hvac.picture.history import FLAWED_LOW, INTACT_HIGH, INTACT_LOW, MOST_POINTS, STEP, ZONES, row_of
from cps_envs.hvac.picture.house import House
from cps_envs.hvac.picture.layout import arrange
from cps_envs.hvac.picture.palette import TEMPERATURE_SCALE, temperature_color
from cps_envs.hvac.picture.scene import Scene
from cps_envs.hvac.picture.traces import marked_steps, range_of, worst_zone
from cps_envs.hvac.picture.viewer import HOUSE, Viewer
from cps_envs.hvac.sensors import membership
from tests.hvac.games import go, started

ATTACK, DEFENSE = "cps_envs:cps_envs/HvacAttack-v0", "cps_envs:cps_envs/HvacDefense-v0"
DAY: dict[str, Any] = {"num_steps": 150, "window_steps": 100, "onset_step": 105}
CONFIG = HvacConfig(**DAY)
MODEL = 15  # the last choice with four sensors
SHOWN_C = 22.0

pygame = pytest.importorskip("pygame")
pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")


def attacked(game: HvacGame, steps: int, choice: int = 0) -> list[Scene]:
    """The scenes of so many steps, in which compromised sensors show 22 C from the onset on."""
    forged = absolute_action(game.config, np.full((1, game.config.num_sensors), SHOWN_C))
    scenes = []
    for _ in range(steps):
        legal = choice if game.state.step[0] >= game.config.window_steps or choice == 0 else MODEL
        go(game, legal, forged)
        scenes.append(game.scene(0))
    return scenes


def played(steps: int, choice: int = 0, **overrides: Any) -> Scene:
    game = started(**{**DAY, **overrides})
    return attacked(game, steps, choice)[-1] if steps else game.scene(0)


def frame(scene: Scene, config: HvacConfig = CONFIG) -> Array:
    return Viewer(config).frame(scene)


def ring(zones: int, **overrides: Any) -> HvacConfig:
    """A building whose zones stand in a ring, the first half of them on the ground."""
    pairs = [(zone, zone % zones + 1) for zone in range(1, zones + 1)][: zones if zones > 2 else 1]
    settings: dict[str, Any] = {
        "heat_capacity_j_per_k": tuple(np.linspace(0.4e6, 0.9e6, zones).tolist()),
        "wall_resistance_k_per_w": tuple(np.linspace(0.1, 0.4, zones).tolist()),
        "link_zones": tuple(zone for pair in pairs for zone in pair),
        "link_resistance_k_per_w": tuple(np.linspace(0.01, 0.05, len(pairs)).tolist()),
        "ground_zones": tuple(range(1, zones // 2 + 1)),
        "num_sensors": zones,
        "num_compromised": 1,
        "sensor_sets": (1, 0, 2, 0, *range(1, zones)) if zones > 2 else (1, 0, 2),
    }
    return HvacConfig(**{**DAY, **settings, **overrides})


START, UNDER_WAY = played(0), played(120, 3)


def test_frame_is_an_rgb_picture_as_large_as_those_of_other_problems() -> None:
    picture = frame(START)
    assert picture.dtype == np.uint8
    assert picture.shape == (540, 960, 3)
    assert picture.flags.c_contiguous
    assert picture.flags.writeable


def test_a_new_episode_looks_the_same_whatever_was_drawn_before() -> None:
    used = Viewer(CONFIG)
    used.frame(UNDER_WAY)
    assert np.array_equal(used.frame(replace(UNDER_WAY, episode=99)), frame(UNDER_WAY))
    assert np.array_equal(used.frame(START), frame(START))


def test_the_same_frames_give_the_same_pixels() -> None:
    first, second = Viewer(CONFIG), Viewer(CONFIG)
    for scene in (START, UNDER_WAY, UNDER_WAY):
        assert np.array_equal(first.frame(scene), second.frame(scene))


def bumped(values: Array, place: int, amount: float) -> Array:
    return np.where(np.arange(len(values)) == place, values + amount, values)


@pytest.mark.parametrize(
    "change",
    [
        {"step": 121},
        {"onset": 110},
        {"temperature": bumped(UNDER_WAY.temperature, 3, 1.0)},
        {"estimate": bumped(UNDER_WAY.estimate, 3, 1.0)},
        {"heating": bumped(UNDER_WAY.heating, 0, 200.0)},
        {"outdoor_c": UNDER_WAY.outdoor_c + 1.0},
        {"measured": bumped(UNDER_WAY.measured, 1, 1.0)},
        {"reading": bumped(UNDER_WAY.reading, 2, 1.0)},
        {"compromised": np.arange(4) == 1},
        {"choice": 0},
        {"choice": MODEL},
        {"ready": False},
        {"residual": bumped(UNDER_WAY.residual, 5, 3.0)},
        {"mean_residual": bumped(UNDER_WAY.mean_residual, 5, 3.0)},
        {"metrics": UNDER_WAY.metrics | {"a_impact": 7.0}},
        {"metrics": UNDER_WAY.metrics | {"mean_abs_error_c": 7.0}},
        {"metrics": UNDER_WAY.metrics | {"energy_kwh": 7.0}},
        {"metrics": UNDER_WAY.metrics | {"flawed_steps": 7.0}},
    ],
    ids=lambda change: next(iter(change)),
)
def test_everything_in_a_scene_is_visible(change: dict[str, Any]) -> None:
    assert not np.array_equal(frame(UNDER_WAY), frame(replace(UNDER_WAY, **change)))


def test_curves_grow_with_the_frames_that_were_drawn() -> None:
    viewer, game = Viewer(CONFIG), started(**DAY)
    scenes = attacked(game, 120, 3)
    pictures = [viewer.frame(scene) for scene in scenes]
    assert not np.array_equal(pictures[-1], frame(scenes[-1]))


@pytest.mark.parametrize("zones", [2, 3, 4, 5, 9, 16])
def test_any_building(zones: int) -> None:
    config = ring(zones)
    game = HvacGame(config, 1)
    game.reset(np.ones(1, np.bool_), [np.random.default_rng(0)])
    viewer = Viewer(config)
    for scene in attacked(game, 3):
        viewer.frame(scene)
    assert viewer.frame(game.scene(0)).shape == (540, 960, 3)


@pytest.mark.parametrize(
    "changes",
    [
        {"num_sensors": 8},
        {"noise_std_c": 0.0},
        {"ground_zones": ()},
        {"ground_zones": (1, 2, 3, 4)},
        {"link_zones": (), "link_resistance_k_per_w": ()},
        {"reference_c": 20.0, "sensor_high_c": 90.0},
        {"onset_step": 0},
        {"num_compromised": 4},
        {"attack_action": "bias"},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_other_sensors_seasons_and_attacks(changes: dict[str, Any]) -> None:
    game, config = started(**{**DAY, **changes}), HvacConfig(**{**DAY, **changes})
    viewer = Viewer(config)
    for _ in range(108):
        go(game, 0, np.full(game.action_space["attacker"].shape, -0.4))
        viewer.frame(game.scene(0))
    assert viewer.frame(game.scene(0)).shape == (540, 960, 3)


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


def belief(step: int, choice: int) -> tuple[str, list[bool], bool]:
    scene = replace(UNDER_WAY, step=step, choice=choice)
    return tuple(belief_of(scene, CONFIG, membership(CONFIG)))  # type: ignore[return-value]


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


def test_history_keeps_what_was_true_believed_and_read() -> None:
    member, game = membership(CONFIG), started(**DAY)
    history = History(MOST_POINTS)
    for scene in [game.scene(0), *attacked(game, 120, 3)]:
        history.add(scene.episode, (scene.step,), row_of(scene, member))
        history.add(scene.episode, (scene.step,), row_of(scene, member))
    rows = history.rows()
    assert rows[:, STEP].tolist() == list(range(121))
    np.testing.assert_array_equal(rows[-1, ZONES:], [*scene.temperature, *scene.estimate, *scene.reading])
    assert np.isnan(rows[:100, INTACT_LOW]).all()
    flawed = flawed_sets(member, scene.compromised)
    assert flawed.sum() == 11
    assert rows[-1, INTACT_HIGH] == scene.mean_residual[~flawed].max()
    assert rows[-1, FLAWED_LOW] == scene.mean_residual[flawed].min()


def test_history_of_a_long_episode_is_thinned_but_ends_now() -> None:
    history, member = History(MOST_POINTS), membership(CONFIG)
    for step in range(3 * MOST_POINTS + 2):
        scene = replace(UNDER_WAY, step=step)
        history.add(scene.episode, (step,), row_of(scene, member))
    rows = history.rows()
    assert len(rows) <= MOST_POINTS + 1
    assert (rows[0, STEP], rows[-1, STEP]) == (0, 3 * MOST_POINTS + 1)


def test_the_worst_zone_has_the_largest_error_since_the_onset() -> None:
    rows = np.zeros((120, ZONES + 12))
    rows[:, STEP] = np.arange(120)
    rows[:, ZONES : ZONES + 4] = 25.0
    rows[:105, ZONES] = 40.0
    rows[105:, ZONES + 2] = 24.0
    assert worst_zone(replace(UNDER_WAY, step=104), rows[:105], CONFIG) == 0
    assert worst_zone(replace(UNDER_WAY, step=119), rows, CONFIG) == 2


def test_absurd_estimates_do_not_flatten_the_temperatures() -> None:
    assert range_of(np.array([24.0, 26.0]), np.array([25.0]), CONFIG) == (23.0, 27.0)
    low, high = range_of(np.array([24.0, 45.0]), np.array([-1e6, 1e6]), CONFIG)
    assert 5.0 < low < 10.0
    assert 45.0 < high < 50.0


def test_colours_run_from_cold_to_hot_around_the_reference() -> None:
    assert temperature_color(-5.0, 25.0) == TEMPERATURE_SCALE[0]
    assert temperature_color(25.0, 25.0) == TEMPERATURE_SCALE[50]
    assert temperature_color(70.0, 25.0) == TEMPERATURE_SCALE[-1]


def test_a_logarithmic_plot_puts_decades_at_equal_distances() -> None:
    plot = Plot((0.0, 0.0, 100.0, 100.0), -1.0, 2.0, logarithmic=True)
    np.testing.assert_allclose(np.diff([plot.y(value) for value in (0.1, 1.0, 10.0, 100.0)]), -92.0 / 3.0)
    assert plot.y(0.0) == plot.y(0.1)
    assert plot.marks() == [0.1, 1.0, 10.0, 100.0]


@pytest.mark.parametrize(
    ("steps", "step_s", "times"),
    [(720, 120.0, ["0:00", "6:00", "12:00", "18:00"]), (90, 120.0, ["0:00", "1:00", "2:00"]), (30, 2.0, ["0:00"])],
)
def test_times_below_the_curves_are_round(steps: int, step_s: float, times: list[str]) -> None:
    config = HvacConfig(num_steps=steps, step_s=step_s, window_steps=20, onset_step=25)
    assert [clock(step, config) for step in marked_steps(config)] == times


def test_no_display_is_opened() -> None:
    script = (
        "import os\n"
        "for name in ('SDL_VIDEODRIVER', 'DISPLAY', 'WAYLAND_DISPLAY'): os.environ.pop(name, None)\n"
        "before = dict(os.environ)\n"
        "import gymnasium, pygame\n"
        f"env = gymnasium.make({ATTACK!r}, render_mode='rgb_array')\n"
        "env.reset(seed=0)\n"
        "assert env.render().shape == (540, 960, 3)\n"
        "assert not pygame.display.get_init()\n"
        "assert {name: os.environ.get(name) for name in before} == before\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


@pytest.mark.parametrize("name", [ATTACK, DEFENSE])
def test_gymnasium_renders_arrays(name: str) -> None:
    with gymnasium.make(name, render_mode="rgb_array") as env:
        env.reset(seed=0)
        first = env.render()
        for _ in range(3):
            env.step(np.zeros_like(env.action_space.sample()))
        second = env.render()
    assert isinstance(first, np.ndarray)
    assert isinstance(second, np.ndarray)
    assert first.dtype == np.uint8
    assert first.shape == second.shape == (540, 960, 3)
    assert not np.array_equal(first, second)


def test_window_opens_and_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make(DEFENSE, render_mode="human")
    env.reset(seed=0)
    assert pygame.display.get_surface().get_size() == (960, 540)
    env.step(np.int64(0))
    env.close()
    assert not pygame.display.get_init()


def test_missing_pygame_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(MissingExtraError, match=r"cps-envs\[render\]"):
        Viewer(CONFIG)


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
    belief = belief_of(scene, game.config, membership(game.config))
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
    belief = belief_of(game.scene(0), game.config, membership(game.config))
    assert belief.source == "Controller follows the Kalman filter of no sensor"
    assert not belief.believed.any()
