"""Commands of the robots against section 4 of the specification in the robots' own metres, and their drawn places."""

from __future__ import annotations

import numpy as np
import pytest

from cps_envs.core.compute.kernels import pack, unpack, view
from cps_envs.disbanding.start import place, undisturbed
from cps_envs.disbanding.state import Constants, State, allocate
from cps_paper.testbed.robots.config import BASELINE, MITIGATED, RobotConfig
from cps_paper.testbed.robots.controllers import decide, mark_touching
from cps_paper.testbed.robots.picture.scene import desired_arcs
from cps_paper.testbed.robots.picture.track import Circle
from cps_paper.testbed.robots.start import string_constants
from cps_paper.testbed.robots.state import rules_of

U_MIN, U_MAX, V_D = -0.5, 0.1, 0.25
ONE = np.ones(1, np.bool_)


def string(s: np.ndarray, v: np.ndarray, time_s: float, disbanding_s: float = np.inf) -> State:
    """A State of robots at `s` (m) with speeds `v` (m/s), front to rear; the front platoon may be disbanded."""
    state = allocate(1, 3, 3)
    constants = pack(string_constants(BASELINE))
    place(state, constants, undisturbed(constants, 9)._replace(driver_headway_s=np.full((1, 9), 1.3)), ONE)
    state.step[0] = round(time_s / 0.05)
    state.position[0], state.speed[0] = 10.0 * s, 10.0 * v
    state.disbanding_s[0, 0] = disbanding_s
    return state


def ours(state: State, config: RobotConfig, correction: np.ndarray | None = None) -> np.ndarray:
    """Final commands (9,) in the robots' m/s2; `correction` in those of the road."""
    parameters = pack(string_constants(config))
    held = np.zeros(9) if correction is None else correction
    decide(view(state, 0), unpack(Constants, parameters, 0), rules_of(config), held, np.empty(9), np.empty(9))
    return state.command[0] / 10.0


def law(i: int, s: np.ndarray, v: np.ndarray) -> float:
    """Robot i = 1 (rear) ... 9 (front), automated."""
    at, speed = s[::-1][i - 1], v[::-1][i - 1]
    if i == 9:
        return 3.0 * (V_D - speed)
    gap, closing = s[::-1][i] - at, v[::-1][i] - speed
    if i in (3, 6):
        return gap - 1.0 * speed + 3.0 * closing
    command = (gap - 0.35) + 3.0 * closing
    if i in (2, 5, 8):
        rear_gap, rear_closing = at - s[::-1][i - 2], speed - v[::-1][i - 2]
        command -= (rear_gap - 0.35) + 3.0 * rear_closing
    return command


def human(i: int, s: np.ndarray, v: np.ndarray) -> float:
    """IDM (2.5) with h = 1.3 s; robot 9 has 1000 m of free road."""
    speed = v[::-1][i - 1]
    gap, ahead = (1000.0, V_D) if i == 9 else (max(s[::-1][i] - s[::-1][i - 1], 0.02), v[::-1][i])
    wanted = 0.24 + max(0.0, 1.3 * speed + speed * (speed - ahead) / (2 * np.sqrt(0.5 * 0.1)))
    return U_MAX * (1.0 - (speed / V_D) ** 4 - (wanted / gap) ** 2)


def limited(i: int, u: float, s: np.ndarray, v: np.ndarray, avoids: bool) -> float:
    u = min(max(u, U_MIN), U_MAX)
    if avoids and i < 9:
        gap, speed, ahead = s[::-1][i] - s[::-1][i - 1], v[::-1][i - 1], v[::-1][i]
        if gap <= 0.24 + (speed**2 - ahead**2) / (2 * abs(U_MIN)):
            return U_MIN
    return u


@pytest.mark.parametrize("config", [BASELINE, MITIGATED])
@pytest.mark.parametrize("since_s", [None, 0.0, 0.35, 0.45, 5.0])
def test_commands(config: RobotConfig, since_s: float | None) -> None:
    generator, seen = np.random.default_rng(7), set()
    for _ in range(200):
        s, v = -np.cumsum(generator.uniform(0.15, 0.5, 9)), generator.uniform(0.0, 0.35, 9)
        state = string(s, v, 20.0 + (since_s or 0.0), np.inf if since_s is None else 20.0)
        found = ours(state, config)[::-1]
        for i in range(1, 10):
            driven = since_s is not None and i >= 7
            u = law(i, s, v)
            if driven:
                u = -0.5 if since_s < 0.4 else human(i, s, v)
            avoids = config is BASELINE or since_s is None or driven
            assert found[i - 1] == pytest.approx(limited(i, u, s, v, avoids), abs=1e-6), i
            seen.add((driven, avoids, bool(found[i - 1] == U_MIN)))
    assert (False, config is BASELINE or since_s is None, True) in seen


def test_corrections_reach_mitigable_robots_in_metres_of_the_road() -> None:
    s, v = -0.35 * np.arange(9.0), np.full(9, V_D)
    correction = np.full(9, -2.0)
    plain = ours(string(s, v, 21.0, 20.0), MITIGATED)
    changed = ours(string(s, v, 21.0, 20.0), MITIGATED, correction) - plain
    np.testing.assert_allclose(changed, [0, 0, 0] + 6 * [-0.2], atol=1e-12)
    intact = ours(string(s, v, 21.0), MITIGATED, correction) - ours(string(s, v, 21.0), MITIGATED)
    np.testing.assert_array_equal(intact, np.zeros(9))
    assert ours(string(s, v, 21.0, 20.0), MITIGATED, -60 * np.ones(9))[3:].tolist() == 6 * [U_MIN]


def test_robots_touch_at_the_length_of_a_body() -> None:
    s = -0.35 * np.arange(9.0)
    s[4:] += 0.2495  # robot 5 (q = 4) is 0.1005 m behind robot 6
    state = string(s, np.full(9, V_D), 5.0)
    parameters = pack(string_constants(BASELINE))
    mark_touching(view(state, 0), unpack(Constants, parameters, 0), rules_of(BASELINE))
    assert not state.collided.any()
    state.position[0, 4:] += 0.01
    mark_touching(view(state, 0), unpack(Constants, parameters, 0), rules_of(BASELINE))
    assert np.flatnonzero(state.collided[0]).tolist() == [3, 4]
    assert np.flatnonzero(state.rear_collided[0]).tolist() == [4]


def test_angles_count_counterclockwise_from_the_right() -> None:
    track = Circle((100.0, 100.0), 50.0, 1.5)
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
