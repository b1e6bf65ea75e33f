from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cps_envs.core.types import Array
from cps_envs.testbed.config import BASELINE, RobotConfig
from cps_envs.testbed.picture.scene import Scene, desired_arcs
from cps_envs.testbed.picture.track import Track
from cps_envs.testbed.picture.viewer import Viewer
from cps_envs.testbed.problem import TESTBED

pytest.importorskip("pygame")
ONE = np.ones(1, np.bool_)


def played(seconds: int, disbanded: int = 0, config: RobotConfig = BASELINE) -> Scene:
    """The scene after so many seconds, with a platoon disbanded after the first one."""
    game = TESTBED.game(config, 1)
    game.reset(ONE, [np.random.default_rng(0)])
    for second in range(seconds):
        game.advance({"attacker": np.array([disbanded if second == 1 else 0])}, ONE, 20)
    return game.scene(0)


def frame(scene: Scene, config: RobotConfig = BASELINE) -> Array:
    return Viewer(config).frame(scene)


AFTER = played(6, 3)


def test_frame_is_an_rgb_picture() -> None:
    picture = frame(AFTER)
    assert picture.dtype == np.uint8
    assert picture.shape == (540, 960, 3)


def test_same_scene_gives_the_same_pixels_whatever_was_drawn_before() -> None:
    used = Viewer(BASELINE)
    used.frame(played(3))
    assert np.array_equal(used.frame(AFTER), frame(AFTER))


@pytest.mark.parametrize(
    "change",
    [
        lambda scene: replace(scene, time_s=7.0),
        lambda scene: replace(scene, pose=scene.pose + 0.05),
        lambda scene: replace(scene, pose=scene.pose + np.array([0.0, 0.0, 1.0])),
        lambda scene: replace(scene, desired_arc_m=scene.desired_arc_m + 0.1),
        lambda scene: replace(scene, speeds=scene.speeds * 0.9),
        lambda scene: replace(scene, gaps=scene.gaps + 0.05),
        lambda scene: replace(scene, collided=~scene.collided),
        lambda scene: replace(scene, disbanding_s=np.full(3, np.inf)),
        lambda scene: replace(scene, metrics={**scene.metrics, "velocity_error": 99.9}),
    ],
)
def test_everything_in_the_scene_is_shown(change: Callable[[Scene], Scene]) -> None:
    assert not np.array_equal(frame(change(AFTER)), frame(AFTER))


def test_other_strings_and_circles_are_drawn() -> None:
    config = replace(BASELINE, num_platoons=4, vehicles_per_platoon=4, radius_m=3.0)
    assert frame(played(2, 4, config), config).shape == (540, 960, 3)
    assert frame(played(0), BASELINE).shape == (540, 960, 3)


def test_angles_count_counterclockwise_from_the_right() -> None:
    track = Track((100.0, 100.0), 50.0, 1.5)
    assert track.at(np.pi / 2) == pytest.approx((100.0, 50.0))
    assert track.at(0.0, 10.0) == pytest.approx((160.0, 100.0))
    assert track.place(0.0, 1.5) == pytest.approx(track.at(np.pi / 2))


def test_wanted_places() -> None:
    arcs, speeds = -0.3 * np.arange(9.0), np.full(9, 0.2)
    intact = desired_arcs(arcs, speeds, np.full(3, np.inf), BASELINE)
    ahead = arcs[:-1]
    np.testing.assert_allclose(intact[1:], ahead - [0.35, 0.35, 0.2, 0.35, 0.35, 0.2, 0.35, 0.35])
    assert np.isnan(intact[0])
    driven = desired_arcs(arcs, speeds, np.array([20.0, np.inf, np.inf]), BASELINE)
    assert np.isnan(driven).tolist() == [True] * 3 + [False] * 6
