from __future__ import annotations

import numpy as np
import pytest

from cps_envs.testbed.config import BASELINE
from cps_envs.testbed.picture.scene import desired_arcs
from cps_envs.testbed.picture.track import Track

pytest.importorskip("pygame")


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
