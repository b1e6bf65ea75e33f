"""Whatever both sides do, the state stays physical and the accounts consistent."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cps_envs.rogue.controllers import CONTROLLERS
from cps_envs.rogue.game import RogueGame
from cps_envs.rogue.problem import ROGUE
from cps_envs.rogue.state import State

situations = st.fixed_dictionaries(
    {
        "num_vehicles": st.integers(3, 7),
        "attacker_index": st.integers(1, 2),
        "power_ratio": st.floats(1, 3),
        "contact": st.sampled_from(["pass", "solid"]),
        "separation_m": st.floats(5, 12),
        "alarm_threshold": st.floats(1, 300),
        "human_returns": st.booleans(),
        "min_effort": st.sampled_from([-1.0, -0.5, 0.0]),
    }
)


@settings(max_examples=30, deadline=None)
@given(situation=situations, seed=st.integers(0, 2**32 - 1))
def test_whatever_happens_the_state_stays_physical(situation: dict[str, Any], seed: int) -> None:
    config = ROGUE.config("paper", {**situation, "dt_s": 0.0005})
    game, generator = RogueGame(config, 2), np.random.default_rng(seed)
    game.reset(np.ones(2, bool), [np.random.default_rng(seed), np.random.default_rng(seed + 1)])
    total = np.zeros(2)
    for _ in range(15):
        before = State(*(array.copy() for array in game.state))
        laws = generator.integers(0, [len(CONTROLLERS), 2] * config.num_intact, (2, 2 * config.num_intact))
        attack = generator.choice([-1.0, 1.0, generator.uniform(-1, 1)], (2, 1))
        total += game.advance({"attacker": attack, "defender": laws}, np.ones(2, bool), 4)
        assert_physical(game, before)
    metrics = game.metrics()
    assert np.allclose(total, metrics["damage"] + metrics["formation_charge"])
    assert np.all(metrics["damage_ahead"] <= metrics["damage"] + 1e-9)
    assert np.all((metrics["first_collision_s"] >= 0) == (metrics["collisions"] > 0))
    assert np.all((metrics["first_alarm_s"] >= 0) == (metrics["alarms"] > 0))
    assert np.all((metrics["formation_cost_s"] >= 0) & (metrics["formation_cost_s"] <= 6.0))


def assert_physical(game: RogueGame, before: State) -> None:
    vehicles, config = game.state, game.config
    for name, values in vehicles._asdict().items():
        assert np.isfinite(values).all(), name
    assert (vehicles.speed >= 0).all()
    assert (vehicles.speed <= config.power_ratio * 50 + 1e-9).all()
    assert (vehicles.front_detector >= 0).all()
    assert (vehicles.rear_detector >= 0).all()
    assert (vehicles.growth >= before.growth).all()
    latched = before.alarm != 0
    assert np.array_equal(vehicles.alarm[latched], before.alarm[latched])
    if config.contact == "solid":
        gaps = np.diff(vehicles.position)
        assert (gaps >= config.vehicle_length_m - 0.5).all()  # one sweep of overlap removal
        assert (np.diff(vehicles.position) > 0).all()
    else:
        assert (vehicles.position >= before.position).all()
