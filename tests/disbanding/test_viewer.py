from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cps_envs.core.picture.vehicle import VEHICLE_M
from cps_envs.disbanding.config import DisbandingConfig
from cps_envs.disbanding.picture.convoy import BEYOND_M, lay_out
from cps_envs.disbanding.picture.palette import SPEED_SCALE
from tests.disbanding.pictures import CONFIG, START, frame, played

pygame = pytest.importorskip("pygame")


def test_the_viewer_shows_whom_the_warning_has_reached() -> None:
    config = DisbandingConfig(warning="relayed")
    scene = played(config, {1: 10}, 4)
    assert scene.warned is not None
    warned = np.flatnonzero(scene.warned[10:])
    assert warned.tolist() == list(range(30))
    told = replace(scene, warned=np.ones(100, np.bool_))
    assert not np.array_equal(frame(scene, config), frame(told, config))


def test_absent_platoons_are_left_out() -> None:
    drawn = DisbandingConfig(num_platoons=(2, 10))
    scene = played(drawn, {}, 0)
    assert len(scene.disbanding_s) < 10
    fixed = DisbandingConfig(num_platoons=len(scene.disbanding_s))
    assert np.array_equal(frame(scene, drawn), frame(replace(scene, config=fixed), fixed))


def test_a_row_holds_a_platoon_in_steady_state_and_everything_fits_later() -> None:
    convoy = lay_out(START)
    assert convoy.rows == 10
    np.testing.assert_allclose(convoy.spans()[:, 0], BEYOND_M + np.arange(10) * convoy.row_m)
    stretched = lay_out(played(CONFIG, {1: 10}, 60))
    assert stretched.row_m > convoy.row_m
    assert stretched.behind_m.max() + VEHICLE_M <= stretched.road_m


def test_gaps_are_drawn_between_bumpers() -> None:
    convoy = lay_out(START)
    np.testing.assert_allclose(np.diff(convoy.behind_m), VEHICLE_M - np.diff(START.position))


def test_speed_scale_spans_the_speeds() -> None:
    slow, fast = SPEED_SCALE[0], SPEED_SCALE[-1]
    convoy = lay_out(replace(START, speed=np.resize([-1.0, 0.0, 36.0, 40.0], 100)))
    assert [convoy.color(q) for q in range(4)] == [slow, slow, fast, fast]
