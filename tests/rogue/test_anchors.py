"""The configuration and the numbers of the specification: stable step, single runs, times of detection, maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.rogue.controllers import HeldController
from cps_baselines.rogue.disband import Disband
from cps_baselines.rogue.square import SquareWave
from cps_baselines.rogue.switching import Switching
from cps_envs.core.conformance import check_refinement
from cps_envs.core.game.match import Match
from cps_envs.core.game.play import finish, play_episodes
from cps_envs.core.policies.policy import Policy
from cps_envs.core.types import Array
from cps_envs.rogue.config import EASY, PAPER, RogueConfig
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.stability import largest_ahead, largest_behind

FREQUENCIES_HZ = np.round(np.linspace(0.02, 0.5, 17), 3)
RATIOS = (1.0, 1.1, 1.2, 1.3, 1.4)
SINGLE = {  # f 0.1 Hz, ratio 1.2, T 100 s: "pass" in m, "solid" in m/s
    "linear": (106.528, 47.157),
    "sliding": (45.144, 10.781),
    "detecting": (179.331, 39.114),
}
MAPS = {  # maximum and mean of Figs. 5.6 to 5.11 for "pass", then for "solid"
    "linear": (1892, 121.3, 83.3, 16.8),
    "sliding": (1759, 95.8, 27.9, 3.5),
    "detecting": (1260, 97.6, 105.9, 16.7),
    2.0: (1811, 134.9, 48.5, 6.9),
    4.0: (1820, 120.7, 48.3, 5.9),
    7.0: (1290, 74.0, 48.0, 6.4),
}


def make(**overrides: Any) -> RogueConfig:
    return ROGUE.config("paper", overrides)


def test_paper_is_table_5_1_and_deterministic() -> None:
    assert (PAPER.num_vehicles, PAPER.attacker_index) == (5, 3)
    assert (PAPER.drive_mps2, PAPER.drag_per_s, PAPER.max_effort, PAPER.min_effort) == (5.0, 0.1, 1.0, -1.0)
    assert (PAPER.surface_slope_per_s, PAPER.boundary_layer_mps) == (0.1, 0.025)
    assert (PAPER.alarm_threshold, PAPER.detector_cutoff_hz) == (200.0, 0.01)
    assert PAPER.contact == "pass"
    assert not any(isinstance(value, tuple) and value for value in vars(PAPER).values())


def test_learning_is_solid_finely_integrated_and_priced() -> None:
    assert EASY.contact == "solid"
    assert EASY.dt_s <= 0.001
    assert EASY.power_ratio == (1.0, 1.6)
    assert EASY.formation_weight_mps2 == 0.5


@pytest.mark.parametrize(
    ("overrides", "bound_s"),
    [({}, 1.11e-3), ({"onset_s": 5.0, "dt_s": 0.0005}, 0.90e-3), ({"num_vehicles": 30, "dt_s": 0.0005}, 0.83e-3)],
)
def test_stable_steps_of_the_specification(overrides: dict[str, float], bound_s: float) -> None:
    assert make(**overrides).stable_below_s == pytest.approx(bound_s, rel=0.01)


def coupling(num_vehicles: int) -> Array:
    """K in e_front + e_rear = -K x + constants: each vehicle between its neighbours, the rear one has one."""
    matrix = 2.0 * np.eye(num_vehicles) - np.eye(num_vehicles, k=1) - np.eye(num_vehicles, k=-1)
    matrix[0, 0] = 1.0
    return matrix


def test_the_largest_couplings_of_the_specification() -> None:
    assert largest_behind(5) == pytest.approx(3.68, abs=0.005)
    assert largest_ahead(2) == pytest.approx(3.0)


@pytest.mark.parametrize("num_vehicles", [3, 5, 12, 100])
def test_the_largest_couplings_are_eigenvalues(num_vehicles: int) -> None:
    whole = coupling(num_vehicles)
    assert largest_behind(num_vehicles) == pytest.approx(np.linalg.eigvalsh(whole)[-1])
    for place in range(1, num_vehicles):
        assert largest_ahead(num_vehicles - place) == pytest.approx(np.linalg.eigvalsh(whole[place:, place:])[-1])


def test_a_hundred_vehicles_with_the_step_they_need() -> None:
    assert make(num_vehicles=100, attacker_index=(1, 99), dt_s=0.0005).num_intact == 99


def defender(game: RogueGame, kind: str | float) -> Policy:
    spec = game.spec("defender")
    return HeldController(spec, kind) if isinstance(kind, str) else Disband(spec, kind)


def damages(kind: str | float, frequencies_hz: np.ndarray | float, **overrides: object) -> np.ndarray:
    """Damage per frequency under a law or under disbanding with a threshold in m."""
    frequencies = np.atleast_1d(frequencies_hz)
    game = RogueGame(ROGUE.config("paper", overrides), len(frequencies))
    players = {"attacker": SquareWave(game.spec("attacker"), frequencies), "defender": defender(game, kind)}
    match = Match(game, players)
    match.reset(np.ones(len(frequencies), bool), [np.random.default_rng(0)] * len(frequencies))
    finish(match)
    return game.metrics()["damage"].copy()


@pytest.mark.parametrize("kind", SINGLE)
@pytest.mark.parametrize(("column", "contact"), [(0, "pass"), (1, "solid")])
def test_single_runs(kind: str, column: int, contact: str) -> None:
    found = damages(kind, 0.1, power_ratio=1.2, contact=contact)
    assert found == pytest.approx(SINGLE[kind][column], abs=6e-4)


@pytest.mark.parametrize(
    ("kind", "frequency_hz", "expected"),
    [
        ("sliding", 0.02, 670),
        ("sliding", 0.05, 124),
        ("sliding", 0.1, 25.4),
        ("detecting", 0.02, 55),
        ("detecting", 0.05, 29.5),
        ("detecting", 0.1, 8.2),
        (2.0, 0.02, 867),
        (2.0, 0.05, 34.2),
        (2.0, 0.1, 62.6),
    ],
)
def test_claims_at_equal_power(kind: str | float, frequency_hz: float, expected: float) -> None:
    assert damages(kind, frequency_hz) == pytest.approx(expected, rel=0.01)  # printed with two or three digits


def test_times_of_detection() -> None:
    game = RogueGame(ROGUE.config("paper", {"control_period_s": 0.01, "duration_s": 10.0}), 1)
    game.reset(np.ones(1, bool), [np.random.default_rng(0)])
    times_s: dict[int, float] = {}
    for period in range(1000):
        attack = np.array([[1.0 if period < 500 else -1.0]])
        game.advance({"attacker": attack, "defender": np.array([[5, 0] * 4])}, np.ones(1, bool), 1)
        for vehicle in np.flatnonzero(game.state.alarm[0]) + 1:
            times_s.setdefault(int(vehicle), (period + 1) / 100)
    assert times_s == pytest.approx({4: 2.14, 5: 2.51, 2: 4.79, 1: 6.27}, abs=0.011)
    assert game.metrics()["first_alarm_s"] == pytest.approx(2.14, abs=0.005)


@pytest.mark.parametrize(
    ("law", "ratio", "weights", "expected"),
    [
        ("linear", 1.3, (1.34, 0.16, -0.69, 4.35, -0.14, -0.47, -0.71), 120.6),
        ("sliding", 1.0, (1.25, -0.52, -0.94, 0.99, 0.15, 0.16, 0.31), 56.0),
    ],
)
def test_closed_loop_attackers(law: str, ratio: float, weights: tuple[float, ...], expected: float) -> None:
    config = ROGUE.config("paper", {"contact": "solid", "duration_s": 60.0, "power_ratio": ratio})
    game = RogueGame(config, 1)
    players = {"attacker": Switching(game.spec("attacker"), weights), "defender": defender(game, law)}
    assert play_episodes(ROGUE, config, players, [0])["damage"] == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize("kind", MAPS)
def test_maxima_of_the_paper_s_maps_lie_in_their_corner(kind: str | float) -> None:
    assert damages(kind, 0.02, power_ratio=1.4) == pytest.approx(MAPS[kind][0], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("kind", MAPS)
@pytest.mark.parametrize(("column", "contact"), [(0, "pass"), (2, "solid")])
def test_maps(kind: str | float, column: int, contact: str) -> None:
    found = np.array([damages(kind, FREQUENCIES_HZ, power_ratio=ratio, contact=contact) for ratio in RATIOS])
    assert found.max() == pytest.approx(MAPS[kind][column], rel=0.01)
    assert found.mean() == pytest.approx(MAPS[kind][column + 1], rel=0.03, abs=0.06)


@pytest.mark.parametrize("law", ["pd", "sliding", "sliding_detection"])
def test_half_the_step_changes_little(law: str) -> None:
    players = {"attacker": "square", "defender": law}
    for contact in ("pass", "solid"):
        found = check_refinement(
            ROGUE,
            players,
            {"dt_s": 0.0005},
            metric="damage",
            preset="paper",
            tolerance=0.0005,
            power_ratio=1.2,
            contact=contact,
        )
        assert found.fine > 1.0
