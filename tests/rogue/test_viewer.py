from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

from cps_agents.cli import app
from cps_envs.core.errors import MissingExtraError
from cps_envs.core.types import Array
from cps_envs.rogue.config import PRESETS, RogueConfig
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.picture.bars import wanted_growth
from cps_envs.rogue.picture.history import MOST_POINTS, Recording
from cps_envs.rogue.picture.palette import LAW_COLORS
from cps_envs.rogue.picture.road import lay_out, named, window_m
from cps_envs.rogue.picture.scene import Scene
from cps_envs.rogue.picture.viewer import Viewer, plots

ATTACK, DEFENSE = "cps_envs:cps_envs/RogueAttack-v0", "cps_envs:cps_envs/RogueDefense-v0"
EVERY = np.ones(1, np.bool_)
CONFIG = RogueConfig()
SOLID = replace(CONFIG, contact="solid", power_ratio=1.3, duration_s=60.0)
ROAD = (16.0, 118.0, 928.0, 74.0)
DETECTING, HUMAN = CONTROLLERS.index("detecting"), CONTROLLERS.index("human")

pygame = pytest.importorskip("pygame")


def opened(config: RogueConfig, seed: int = 0) -> RogueGame:
    game = RogueGame(config, 1)
    game.reset(EVERY, [np.random.default_rng(seed)])
    return game


def drive(game: RogueGame, effort: float, law: int = DETECTING, modified: int = 0, periods: int = 1) -> Scene:
    """The scene after some periods of full driving (1) or braking (-1) under one law of all."""
    actions = {"attacker": np.array([[effort]])}
    if game.modes:
        actions["defender"] = np.tile([law, modified], game.config.num_intact)[np.newaxis]
    game.advance(actions, EVERY, periods)
    return game.scene(0)


def played(config: RogueConfig, seconds: float, law: int = DETECTING, modified: int = 0, seed: int = 0) -> Scene:
    """The scene under a square wave of 0.1 Hz."""
    game = opened(config, seed)
    scene = game.scene(0)
    for k in range(round(10 * seconds)):
        scene = drive(game, 1.0 if k % 100 < 50 else -1.0, law, modified)
    return scene


def frame(scene: Scene, config: RogueConfig = CONFIG) -> Array:
    return Viewer(config).frame(scene)


START, UNDER_WAY, SCATTERED = (played(CONFIG, seconds) for seconds in (0, 4, 60))
PUSHED = played(SOLID, 8)


def test_frame_is_an_rgb_picture_as_large_as_those_of_other_problems() -> None:
    picture = frame(START)
    assert picture.dtype == np.uint8
    assert picture.shape == (540, 960, 3)
    assert picture.flags.c_contiguous
    assert picture.flags.writeable


def test_a_new_episode_looks_the_same_whatever_was_drawn_before() -> None:
    used = Viewer(CONFIG)
    for scene in (UNDER_WAY, SCATTERED):
        used.frame(scene)
    assert np.array_equal(used.frame(START), frame(START))
    other = played(CONFIG, 70, seed=1)
    used.frame(SCATTERED)
    assert np.array_equal(used.frame(other), frame(other))


def test_the_same_frames_give_the_same_pixels() -> None:
    first, second = Viewer(CONFIG), Viewer(CONFIG)
    for scene in (START, UNDER_WAY, SCATTERED, SCATTERED):
        assert np.array_equal(first.frame(scene), second.frame(scene))


def test_curves_hold_what_was_only_watched() -> None:
    drawn, watching = Viewer(CONFIG), Viewer(CONFIG)
    drawn.frame(START)
    watching.watch(START)
    assert np.array_equal(drawn.frame(UNDER_WAY), watching.frame(UNDER_WAY))
    assert not np.array_equal(watching.frame(UNDER_WAY), frame(UNDER_WAY))


def bumped(values: Array, place: int, amount: float) -> Array:
    return np.where(np.arange(len(values)) == place, values + amount, values)


@pytest.mark.parametrize(
    "change",
    [
        {"time_s": 5.0},
        {"duration_s": 50.0},
        {"attacker": 1},
        {"effort": 0.3},
        {"effort_limits": (-2.0, 1.0)},
        {"power_ratio": 1.2},
        {"position": bumped(UNDER_WAY.position, 0, -1.0)},
        {"position": UNDER_WAY.position + 3.1},
        {"speed": bumped(UNDER_WAY.speed, 1, 2.0)},
        {"acceleration": bumped(UNDER_WAY.acceleration, 3, -20.0)},
        {"reference_m": UNDER_WAY.reference_m + 5.0},
        {"reference_speed_mps": 29.0},
        {"growth": bumped(UNDER_WAY.growth, 0, 0.5)},
        {"law": ("linear", *UNDER_WAY.law[1:])},
        {"alarm": bumped(UNDER_WAY.alarm, 0, 1)},
        {"detector": UNDER_WAY.detector + 40.0},
        {"contact": "solid"},
        {"touching": np.arange(4) == 0},
        {"damage": bumped(UNDER_WAY.damage, 1, 3.0)},
        *({"metrics": UNDER_WAY.metrics | {name: 3.0}} for name in ("damage", "collisions", "alarms", "humans")),
        {"metrics": UNDER_WAY.metrics | {"first_alarm_s": 1.0}},
        {"metrics": UNDER_WAY.metrics | {"first_collision_s": 3.0}},
        {"metrics": UNDER_WAY.metrics | {"reference_error_m": 30.0}},
    ],
    ids=lambda change: next(iter(change)),
)
def test_everything_in_a_scene_is_visible(change: dict[str, Any]) -> None:
    assert not np.array_equal(frame(UNDER_WAY), frame(replace(UNDER_WAY, **change)))


def test_the_charge_is_shown_where_there_is_one() -> None:
    charged = replace(CONFIG, formation_weight_mps2=0.5)
    more = replace(UNDER_WAY, metrics=UNDER_WAY.metrics | {"formation_charge": 7.0})
    assert np.array_equal(frame(UNDER_WAY), frame(more))
    assert not np.array_equal(frame(UNDER_WAY, charged), frame(more, charged))


@pytest.mark.parametrize("contact", ["pass", "solid"])
@pytest.mark.parametrize(("num_vehicles", "seized"), [(3, 1), (3, 2), (5, 1), (5, 4), (10, 1), (20, 9), (20, 19)])
def test_platoons_of_any_size_with_any_vehicle_seized(num_vehicles: int, seized: int, contact: str) -> None:
    config = replace(
        PRESETS["easy"], num_vehicles=num_vehicles, attacker_index=seized, contact=contact, duration_s=20.0
    )
    viewer = Viewer(config)
    game = opened(config)
    for law in (DETECTING, HUMAN):
        scene = drive(game, 1.0, law, 1, 80)
        assert viewer.frame(scene).shape == (540, 960, 3)


@pytest.mark.parametrize(
    "changes",
    [
        {"separation_m": 100.0},
        {"separation_m": 4.6},
        {"vehicle_length_m": 1.0, "separation_m": 2.0},
        {"min_effort": 0.0},
        {"duration_s": 1.0},
        {"defense_action": "command"},
        {"reference_speed_mps": 1.0},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_other_sizes_and_speeds(changes: dict[str, Any]) -> None:
    config = replace(CONFIG, **changes)
    assert frame(played(config, 1), config).shape == (540, 960, 3)


def test_the_attacker_stays_where_it_is_and_gaps_are_to_scale() -> None:
    for scene in (START, UNDER_WAY, SCATTERED):
        road = lay_out(scene, ROAD)
        assert road.centre[2] == pytest.approx(ROAD[0] + ROAD[2] / 2)
        np.testing.assert_allclose(np.diff(road.centre), np.diff(scene.position) * road.scale)
        assert road.car[0] == pytest.approx(scene.vehicle_length_m * road.scale, abs=0.5)
    assert lay_out(START, ROAD).reference == pytest.approx(lay_out(START, ROAD).centre[-1])


@pytest.mark.parametrize("num_vehicles", [3, 5, 20])
@pytest.mark.parametrize("seized", [0, 1])
def test_the_platoon_in_steady_state_is_in_sight(num_vehicles: int, seized: int) -> None:
    config = replace(CONFIG, num_vehicles=num_vehicles, attacker_index=seized + 1, dt_s=0.0005)
    scene = opened(config).scene(0)
    road = lay_out(scene, ROAD)
    assert [road.sight(float(x)) for x in road.centre] == [0] * num_vehicles
    assert window_m(scene)[0] > scene.position[-1] - scene.position[0]


def test_out_of_sight_vehicles_are_named_or_counted() -> None:
    assert named([3, 4, 5], 5) == "4, 5, reference"
    assert named([0], 5) == "1"
    assert named([4, 5, 6, 7, 8, 9], 9) == "5 vehicles"
    assert named([4, 5, 6, 7, 8], 9) == "5 vehicles"
    behind = replace(UNDER_WAY, position=bumped(UNDER_WAY.position, 0, -300.0))
    assert lay_out(behind, ROAD).sight(float(lay_out(behind, ROAD).centre[0])) == -1


def test_markings_stay_on_the_road() -> None:
    """A road that has moved by one period of its markings looks the same."""
    ahead = replace(START, position=START.position + 12.0, reference_m=START.reference_m + 12.0)
    elsewhere = replace(START, position=START.position + 5.0, reference_m=START.reference_m + 5.0)
    assert np.array_equal(frame(START), frame(ahead))
    assert not np.array_equal(frame(START), frame(elsewhere))


def test_contact_is_marked_while_it_lasts_and_shortly_after() -> None:
    game = opened(SOLID)
    scene, viewer, recording = game.scene(0), Viewer(SOLID), Recording()
    while not scene.damage.any():
        recording.add(scene)
        scene = drive(game, 1.0)
    recording.add(scene)
    np.testing.assert_array_equal(recording.damaged_since(scene.time_s - 0.6), scene.damage > 0)
    for _ in range(8):
        scene = replace(scene, time_s=scene.time_s + 0.1)
        recording.add(scene)
    assert not recording.damaged_since(scene.time_s - 0.6).any()
    released = replace(scene, touching=np.zeros_like(scene.touching))
    held = replace(scene, touching=np.ones_like(scene.touching))
    assert not np.array_equal(viewer.frame(released), viewer.frame(held))


def test_touching_lasts_from_contact_until_the_pair_is_apart() -> None:
    game = opened(SOLID)
    scene = game.scene(0)
    for k in range(150):
        scene = drive(game, 1.0 if k % 100 < 50 else -1.0)
        assert not scene.touching[scene.gap > 0.06].any()
        assert scene.touching[scene.gap < 0.0].all()
    assert scene.metrics["collisions"] > 0


def test_growth_is_wanted_of_whom_one_follows() -> None:
    growth = np.array([1.0, 2.0, 0.0, 3.0, 4.0])
    laws = ("front", "front", "attacker", "rear", "human")
    scene = replace(START, growth=growth, law=laws)
    assert [wanted_growth(scene, pair) for pair in range(4)] == [1.0, 2.0, 3.0, 0.0]


def test_every_law_has_its_own_colour() -> None:
    assert set(LAW_COLORS) == {*CONTROLLERS, "commanded", "attacker"} - {"detecting"}
    assert len(set(LAW_COLORS.values())) == len(LAW_COLORS)


def moments(recording: Recording, scene: Scene, times: Callable[[int], float], count: int) -> None:
    for k in range(count):
        recording.add(replace(scene, time_s=times(k), speed=scene.speed + k))


def test_history_is_thinned_and_keeps_the_last_moment() -> None:
    recording = Recording()
    moments(recording, START, lambda k: 0.1 * k, 10 * MOST_POINTS + 7)
    traces = recording.traces()
    assert MOST_POINTS / 2 < len(traces.time_s) <= MOST_POINTS + 1
    assert traces.time_s[-1] == pytest.approx(0.1 * (10 * MOST_POINTS + 6))
    assert (np.diff(traces.time_s) > 0).all()
    assert traces.speed.shape[1:] == (5,)
    assert traces.gap.shape == traces.damage.shape == (len(traces.time_s), 4)


def test_history_replaces_the_same_moment_and_forgets_when_time_goes_back() -> None:
    recording = Recording()
    moments(recording, START, lambda k: min(k, 3), 6)
    traces = recording.traces()
    assert traces.time_s.tolist() == [0, 1, 2, 3]
    np.testing.assert_array_equal(traces.speed[-1], START.speed + 5)
    recording.add(UNDER_WAY)
    recording.add(START)
    assert recording.traces().time_s.tolist() == [0.0]


def test_axes_hold_what_they_show() -> None:
    recording = Recording()
    for scene in (START, UNDER_WAY, PUSHED, SCATTERED):
        recording.add(replace(scene, episode=1, time_s=scene.time_s))
    traces = recording.traces()
    (_, gaps), (_, speeds), (damage, total) = plots(SCATTERED, traces)
    assert gaps.low <= traces.gap[:, 1:3].min() <= traces.gap[:, 1:3].max() <= gaps.high
    assert traces.speed.max() <= speeds.high
    assert damage.shows(float(SCATTERED.damage.max()))
    assert total.shows(float(SCATTERED.damage.sum()))


def test_a_picture_of_a_late_moment_shows_what_led_to_it(tmp_path: Path) -> None:
    imageio = pytest.importorskip("imageio.v3")
    target = tmp_path / "late.png"
    arguments = ("play", "rogue", "--attacker", "none", "--defender", "pd", "--set", "duration_s=3", "--at", "2")
    assert CliRunner().invoke(app, [*arguments, "--render", str(target)]).exit_code == 0
    config = replace(CONFIG, duration_s=3.0)
    game, viewer = opened(config), Viewer(config)
    game.reset(EVERY, [np.random.default_rng(0)])
    for _ in range(20):
        viewer.watch(game.scene(0))
        drive(game, 0.0, CONTROLLERS.index("linear"))
    shown = imageio.imread(target)
    assert np.array_equal(shown, viewer.frame(game.scene(0)))


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
    assert first.shape == second.shape == (540, 960, 3)
    assert not np.array_equal(first, second)


def test_window_opens_and_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make(ATTACK, render_mode="human")
    env.reset(seed=0)
    assert pygame.display.get_surface().get_size() == (960, 540)
    env.step(np.zeros(1, np.float32))
    env.close()
    assert not pygame.display.get_init()


def test_missing_pygame_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(MissingExtraError, match=r"cps-envs\[render\]"):
        Viewer(CONFIG)
