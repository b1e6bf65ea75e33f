"""The kernels against plain NumPy: whole closed loops under random choices, attacks and plants."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cps_envs.core.types import Array
from cps_envs.hvac.building import transition
from cps_envs.hvac.config import PAPER
from cps_envs.hvac.game import HvacGame
from cps_envs.hvac.moving_horizon import MAX_CONDITION, set_gains
from cps_envs.hvac.sensors import membership, sensor_sets, zones_of_sensors
from tests.hvac.games import go, started
from tests.hvac.reference import Reference

pytestmark = pytest.mark.filterwarnings("ignore::cps_envs.hvac.moving_horizon.ObservabilityWarning")  # short windows


def forged(game: HvacGame, seed: int, base: float) -> tuple[Callable[..., Any], Array]:
    """What the attacker does at every step: the readings as the text of the documentation has them, and the actions."""
    actions = np.random.default_rng(seed).uniform(-1, 1, (720, game.config.num_sensors + 1))
    actions[:, -1] = base
    compromised, onset = game.state.compromised[0].copy(), int(game.state.onset[0])
    zone = np.arange(game.config.num_sensors) % 4

    def readings(k: int, own: Any, x: Any) -> Any:
        if k < onset or k == 0:
            return own
        start = {-1.0: x[zone], 0.0: own, 1.0: np.full(len(own), 25.0)}[base]
        return np.where(compromised, np.clip(start + 15 * actions[k - 1, :-1], 10, 40), own)

    return readings, actions


@pytest.mark.parametrize(
    ("seed", "base", "overrides"),
    [
        (0, 1.0, {"window_steps": 100, "onset_step": 0}),
        (1, 0.0, {"window_steps": 120, "onset_step": 110, "num_compromised": 4}),
        (2, -1.0, {"window_steps": 100, "onset_step": 120, "num_sensors": 8, "num_compromised": 5}),
        (3, 0.0, {"window_steps": 200, "onset_step": 150, "model_error": 0.05, "unmeasured_heat_w": 100.0}),
    ],
)
def test_closed_loops_agree(seed: int, base: float, overrides: dict[str, Any]) -> None:
    game = started([seed], **overrides)
    readings, actions = forged(game, seed, base)
    generator = np.random.default_rng([seed, 1])
    choices = generator.integers(0, len(sensor_sets(game.config)) + 2, game.config.window_steps + 80)
    steps = len(choices)
    drawn = np.random.default_rng(seed).standard_normal((game.config.num_steps, game.config.num_sensors))
    expected = Reference(
        noise=np.sqrt(0.2) * drawn,
        sets=sensor_sets(game.config),
        window=game.config.window_steps,
        A_p=game.state.plant[0].copy(),
        heat=game.state.heat[0].copy(),
        forge=readings,
        choose=lambda k, seen: int(choices[k]),
        steps=steps,
    ).run()
    # Sums over a window square cond(O_a); sets that hardly observe are estimated from the window itself.
    member, zone = membership(game.config), zones_of_sensors(game.config)
    condition = set_gains(transition(PAPER, np.zeros((4, 4))), game.config.window_steps, member, zone)[1]
    exact = max(
        1e-7, 25.0 * np.finfo(float).eps * condition[condition <= MAX_CONDITION].max() ** 2
    )  # C, of readings of about 25 C
    for k in range(steps):
        np.testing.assert_allclose(game.state.temperature[0], expected["x"][k], rtol=1e-8, err_msg=f"x({k})")
        if k >= game.config.window_steps:
            np.testing.assert_allclose(game.state.residual[0], expected["J"][k], rtol=1e-6, atol=1e-7)
        go(game, choices[k], actions[k])
        np.testing.assert_allclose(game.state.fed[0], expected["fed"][k], rtol=1e-8, atol=exact, err_msg=f"xh({k})")
        np.testing.assert_array_equal(np.round(game.state.heating[0]), expected["u"][k], err_msg=f"u({k})")


def test_plants_are_off_by_entries_and_by_heat() -> None:
    game = started(range(200), model_error=0.05, unmeasured_heat_w=100.0)
    nominal = transition(PAPER, np.zeros((4, 4)))
    entries = nominal - np.eye(4) != 0
    shares = (game.state.plant - nominal)[:, entries] / (nominal - np.eye(4))[entries]
    assert np.abs(shares).max() <= 0.05 + 1e-9
    assert shares.std(axis=0) == pytest.approx(np.full(12, 0.05 / np.sqrt(3)), rel=0.15)
    assert np.abs(game.state.heat).max() <= 100
    assert game.state.heat.std() == pytest.approx(100 / np.sqrt(3), rel=0.1)
    assert (started(model_error=0.0).state.plant[0] == nominal).all()
