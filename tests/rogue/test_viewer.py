from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cps_envs.core.picture.history import History
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.picture.palette import LAW_COLORS
from cps_envs.rogue.picture.profile import wanted_growth
from cps_envs.rogue.picture.road import lay_out, named, window_m
from cps_envs.rogue.picture.viewer import RogueViewer, damaged_since, panels
from tests.agents.command_line import invoke
from tests.pictured import bumped
from tests.rogue.pictures import CONFIG, EVERY, PUSHED, SCATTERED, SOLID, START, UNDER_WAY, drive, frame, opened

ROAD = (16.0, 118.0, 928.0, 74.0)

pygame = pytest.importorskip("pygame")


def test_the_charge_is_shown_where_there_is_one() -> None:
    charged = replace(CONFIG, formation_weight_mps2=0.5)
    more = UNDER_WAY.metrics | {"formation_charge": 7.0}
    assert np.array_equal(frame(UNDER_WAY), frame(replace(UNDER_WAY, metrics=more)))
    under_charge = replace(UNDER_WAY, config=charged)
    assert not np.array_equal(frame(under_charge), frame(replace(under_charge, metrics=more)))


def test_the_attacker_stays_where_it_is_and_gaps_are_to_scale() -> None:
    for scene in (START, UNDER_WAY, SCATTERED):
        road = lay_out(scene, ROAD)
        assert road.centre[2] == pytest.approx(ROAD[0] + ROAD[2] / 2)
        np.testing.assert_allclose(np.diff(road.centre), np.diff(scene.position) * road.scale)
        assert road.cars[0][0] == pytest.approx(scene.config.vehicle_length_m * road.scale, abs=0.5)
    assert lay_out(START, ROAD).reference == pytest.approx(lay_out(START, ROAD).centre[-1])


@pytest.mark.parametrize("num_vehicles", [3, 5, 20])
@pytest.mark.parametrize("seized", [0, 1])
def test_the_platoon_in_steady_state_is_in_sight(num_vehicles: int, seized: int) -> None:
    config = replace(CONFIG, num_vehicles=num_vehicles, attacker_index=seized + 1, dt_s=0.0005)
    scene = opened(config).scene(0)
    road = lay_out(scene, ROAD)
    assert all(road.sees(vehicle) for vehicle in range(num_vehicles))
    assert window_m(scene)[0] > scene.position[-1] - scene.position[0]


def test_out_of_sight_vehicles_are_named_or_counted() -> None:
    assert named([3, 4, 5], 5) == "4, 5, reference"
    assert named([0], 5) == "1"
    assert named([4, 5, 6, 7, 8, 9], 9) == "5 vehicles"
    assert named([4, 5, 6, 7, 8], 9) == "5 vehicles"
    behind = replace(UNDER_WAY, position=bumped(UNDER_WAY.position, 0, -300.0))
    assert not lay_out(behind, ROAD).sees(0)
    assert lay_out(behind, ROAD).sight(float(lay_out(behind, ROAD).centre[0]), 10) == -1


def test_markings_stay_on_the_road() -> None:
    """A road that has moved by one period of its markings looks the same."""
    ahead = replace(START, position=START.position + 12.0, reference_m=START.reference_m + 12.0)
    elsewhere = replace(START, position=START.position + 5.0, reference_m=START.reference_m + 5.0)
    assert np.array_equal(frame(START), frame(ahead))
    assert not np.array_equal(frame(START), frame(elsewhere))


def test_contact_is_marked_while_it_lasts_and_shortly_after() -> None:
    game = opened(SOLID)
    scene, viewer, history = (
        game.scene(0),
        RogueViewer(SOLID),
        History(RogueViewer.moment, RogueViewer.kept, RogueViewer.most_points),
    )
    while not scene.damage.any():
        history.add(scene)
        scene = drive(game, 1.0)
    history.add(scene)
    np.testing.assert_array_equal(damaged_since(history, scene.time_s - 0.6), scene.damage > 0)
    for _ in range(8):
        scene = replace(scene, time_s=scene.time_s + 0.1)
        history.add(scene)
    assert not damaged_since(history, scene.time_s - 0.6).any()
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


def test_axes_hold_what_they_show() -> None:
    history = History(RogueViewer.moment, RogueViewer.kept, RogueViewer.most_points)
    for scene in (START, UNDER_WAY, PUSHED, SCATTERED):
        history.add(replace(scene, episode=1))
    curves = history.curves()
    _, _, damage, gaps, speeds, total = (panel.plot for panel in panels(SCATTERED, curves))
    assert gaps.low <= curves["gap"][:, 1:3].min() <= curves["gap"][:, 1:3].max() <= gaps.high
    assert curves["speed"].max() <= speeds.high
    assert damage.shows(float(SCATTERED.damage.max()))
    assert total.shows(float(SCATTERED.damage.sum()))


def test_a_picture_of_a_late_moment_shows_what_led_to_it(tmp_path: Path) -> None:
    imageio = pytest.importorskip("imageio.v3")
    target = tmp_path / "late.png"
    arguments = (
        "play",
        "rogue",
        "--preset",
        "paper",
        "--attacker",
        "none",
        "--defender",
        "pd",
        "--set",
        "duration_s=3",
        "--at",
        "2",
    )
    assert invoke(*arguments, "--render", str(target)).exit_code == 0
    config = replace(CONFIG, duration_s=3.0)
    game, viewer = opened(config), RogueViewer(config)
    game.reset(EVERY, [np.random.default_rng(0)])
    for _ in range(20):
        viewer.watch(game.scene(0))
        drive(game, 0.0, CONTROLLERS.index("linear"))
    shown = imageio.imread(target)
    assert np.array_equal(shown, viewer.frame(game.scene(0)))


def test_a_truck_is_drawn_as_long_as_it_is() -> None:
    config = replace(CONFIG, vehicle_length_m=(4.5, 16.5, 4.5, 4.5, 4.5), separation_m=20.0)
    scene = opened(config).scene(0)
    road = lay_out(scene, ROAD)
    lengths = [car[0] for car in road.cars]
    assert lengths == pytest.approx(np.array([4.5, 16.5, 4.5, 4.5, 4.5]) * road.scale, abs=0.5)
    assert len({car[1] for car in road.cars}) == 1
    assert scene.gap == pytest.approx([9.5, 9.5, 15.5, 15.5])
