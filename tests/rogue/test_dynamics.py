"""Parts of the physics against closed forms and independent integration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy import void
from scipy.integrate import solve_ivp

from cps_envs.core.compute.kernels import records, unpack, view
from cps_envs.core.types import FloatArray
from cps_envs.rogue.contact import touch
from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.dynamics import effort_of
from cps_envs.rogue.formation import scattering
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.payoff import Metrics
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.state import Drawn, Rules, State, allocate, rules_of
from tests.rogue.games import started

ONE = np.ones(1, bool)


def go(game: RogueGame, attack: float, law: str = "linear", modified: int = 0, periods: int = 1) -> None:
    orders = np.tile([CONTROLLERS.index(law), modified], game.config.num_intact)[np.newaxis]
    game.advance({"attacker": np.array([[attack]]), "defender": orders}, ONE, periods)


@pytest.mark.parametrize(("attack", "ratio"), [(1.0, 1.0), (1.0, 1.4), (-1.0, 1.2), (0.0, 1.3)])
def test_the_seized_vehicle_follows_the_closed_form(attack: float, ratio: float) -> None:
    """v' = alpha F - beta v under a constant effort, until it stands."""
    game = started(power_ratio=ratio)
    go(game, attack, periods=30)
    final = 50 * ratio * attack if attack else 25.0
    exact = max(0.0, final + (25 - final) * np.exp(-0.1 * 3.0))
    assert game.state.speed[0, 2] == pytest.approx(exact, abs=1e-3)
    travelled = 18 + final * 3 + (25 - final) * (1 - np.exp(-0.3)) / 0.1
    assert game.state.position[0, 2] == pytest.approx(travelled, abs=0.05)


def test_the_linear_platoon_follows_its_differential_equation() -> None:
    """The intact vehicles of (5.15) inside their limits, integrated by scipy with the attacker's motion as input."""
    spread = {"spacing_spread_m": 0.3, "speed_spread_mps": 0.1, "dt_s": 1e-4}
    game = started(**spread)
    start = State(*(array[0].copy() for array in game.state))
    go(game, 0.0, periods=50)
    seized_speed = start.speed[2]

    def rates(time_s: float, y: FloatArray) -> FloatArray:
        x, v = y[:5], y[5:]
        gaps, closing = np.diff(x) - 9, np.diff(v)
        e, d = np.append(gaps, start.position[4] + 25 * time_s - x[4]), np.append(closing, 25 - v[4])
        u = 1.0 * e + 3.0 * d
        u[1:] -= 1.0 * gaps + 3.0 * closing
        u[2] = 0.0
        return np.concatenate([v, u])

    begin = np.concatenate([start.position, start.speed])
    exact = solve_ivp(rates, (0, 5), begin, rtol=1e-9, atol=1e-9).y[:, -1]
    assert exact[7] == seized_speed
    assert game.state.position[0] == pytest.approx(exact[:5], abs=2e-3)
    assert game.state.speed[0] == pytest.approx(exact[5:], abs=1e-3)


def test_the_slowest_mode_of_five_intact_vehicles() -> None:
    """Specification 4.1: the slowest eigenvalue of the linear platoon has the real part -0.12 1/s."""
    coupling = 2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    coupling[0, 0] = 1
    system = np.block([[np.zeros((5, 5)), np.eye(5)], [-coupling, -3 * coupling]])
    assert np.linalg.eigvals(system).real.max() == pytest.approx(-0.12, abs=0.005)


def test_nothing_happens_without_an_attack() -> None:
    for law in CONTROLLERS[:4] + CONTROLLERS[5:]:
        game = started(power_ratio=1.3)
        go(game, 0.0, law, periods=100)
        assert game.metrics()["damage"] == 0.0
        assert game.state.speed[0] == pytest.approx(np.full(5, 25.0), abs=1e-6)
        assert not game.state.alarm.any()


def test_a_detector_fills_as_its_time_constant_says() -> None:
    """Specification 4.4: at |r| = 10 m/s2, z passes 200 after 2.1 s and tends to 1592 with a leak of 0.0628 1/s."""
    leak = 2 * np.pi * 0.01
    assert 100 / leak == pytest.approx(1592, abs=1)
    assert -np.log(1 - 200 * leak / 100) / leak == pytest.approx(2.14, abs=0.01)
    game = started()
    go(game, 1.0, "sliding", periods=21)
    assert not game.state.alarm.any()
    z = game.state.front_detector[0, 1]
    residual_squared = z * leak / (1 - np.exp(-leak * 2.1))
    assert 0 < residual_squared <= 100.0
    go(game, 1.0, "sliding")
    assert game.state.alarm[0].tolist() == [0, 0, 0, -1, 0]


def test_separations_grow_by_half_a_metre_each_tenth_of_a_second_near_the_set_point() -> None:
    game = started()
    go(game, 0.0, "front", modified=1)
    assert game.state.growth[0].tolist() == [0.5, 0.5, 0.0, 0.5, 0.0]  # not of the leader, nor the seized
    go(game, 0.0, "front", modified=1)
    assert game.state.growth[0, 3] == 1.0  # error 0.5 m < 0.9 m
    go(game, 0.0, "front", modified=0, periods=20)
    assert game.state.growth[0, 3] == 1.0
    growth = started(max_growth_m=1.2)
    for _ in range(100):
        go(growth, 0.0, "front", modified=1)
    assert growth.state.growth[0, 3] == 1.2


def test_efforts_between_braking_keeping_and_driving() -> None:
    r = unpack(Rules, rules_of(ROGUE.presets["paper"]), 0)
    assert [effort_of(a, 0.5, r) for a in (-1.0, -0.5, 0.0, 0.5, 1.0)] == [-1.0, -0.25, 0.5, 0.75, 1.0]


def test_the_onset_delays_the_attack() -> None:
    game = started(onset_s=1.0, dt_s=0.0005)
    go(game, 1.0, periods=10)
    assert game.state.speed[0] == pytest.approx(np.full(5, 25.0), abs=1e-6)
    go(game, 1.0)
    assert game.state.speed[0, 2] > 25.2


def bump(
    contact: str, gap_m: float, rear_mps: float, front_mps: float, *, armed: bool = True, times: int = 1
) -> tuple[State, void]:
    """Vehicles 1 and 2 of an episode, `gap_m` between bumpers, after `times` accounts of contact."""
    r = unpack(Rules, rules_of(ROGUE.config("paper", {"contact": contact})), 0)
    episode, scores = view(allocate(1, 2), 0), records(Metrics, 1)
    episode.length_m[:] = 4.5
    episode.position[:], episode.speed[:], episode.armed[:] = (0.0, 4.5 + gap_m), (rear_mps, front_mps), armed
    scores["first_collision_s"] = -1.0
    for _ in range(times):
        touch(episode, 0, scores.view(np.recarray)[0], r)
    return episode, scores[0]


@given(rear=st.floats(0, 50), front=st.floats(0, 50), overlap=st.floats(1e-6, 2))
def test_solid_bodies_keep_momentum_and_centre_and_lose_energy(rear: float, front: float, overlap: float) -> None:
    vehicles, _ = bump("solid", -overlap, rear, front)
    x, v = vehicles.position, vehicles.speed
    assert v.sum() == pytest.approx(rear + front)
    assert x.mean() == pytest.approx((4.5 - overlap) / 2)
    assert np.diff(x) == pytest.approx(4.5)
    assert np.square(v).sum() <= rear**2 + front**2 + 1e-9
    assert vehicles.damage[0] == pytest.approx(max(0.0, rear - front))
    assert vehicles.collisions[0] == 1


def test_pushing_adds_no_damage_until_the_pair_has_parted() -> None:
    assert bump("solid", -0.1, 30, 20, armed=False)[0].damage[0] == 0.0
    assert not bump("solid", 0.04, 20, 30, armed=False)[0].armed[0]
    assert bump("solid", 0.06, 20, 30, armed=False)[0].armed[0]


def test_passing_vehicles_count_metres_also_when_overtaken() -> None:
    for gap in (-0.1, -20.0):
        vehicles, score = bump("pass", gap, 30, 20, times=7)
        assert vehicles.damage[0] == pytest.approx(7 * 10 * 0.001)
        assert vehicles.speed.tolist() == [30, 20]
        assert vehicles.collisions[0] == 1
        assert score["first_collision_s"] == 0.001


def test_scattering_counts_speeds_and_separations_of_the_intact() -> None:
    game = started()
    vehicles, c, r = view(game.state, 0), unpack(Drawn, game.drawn, 0), unpack(Rules, game.rules, 0)
    assert scattering(vehicles, c, r) == 0.0
    vehicles.speed[:] = (25, 20, 0, 25, 25)  # one of four intact ones a fifth too slow; the seized one is free
    assert scattering(vehicles, c, r) == pytest.approx(0.5 * 0.2 / 4)
    vehicles.speed[:] = 25
    vehicles.position[3:] += 45  # reference 45 m of 90 off; pairs 1-2 and 4-5 as they should be
    assert scattering(vehicles, c, r) == pytest.approx(0.5 * 0.5 / 3)
    vehicles.position[4] += 1000  # limited to 1 each
    assert scattering(vehicles, c, r) == pytest.approx(0.5 * 2 / 3)
