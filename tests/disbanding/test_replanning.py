"""The attacker that plans anew after each attack."""

from __future__ import annotations

from typing import Any

import numpy as np

from cps_baselines.disbanding.families import REPLANNING
from cps_baselines.family import Members
from cps_envs.core.play import play_episodes
from cps_envs.core.types import FloatArray
from cps_envs.disbanding.problem import DISBANDING


def times_s(defender: str, budget: int, tau_s: float = 0.3, **numbers: float) -> FloatArray:
    """When the platoons are disbanded, front to rear, in one episode by the family's start."""
    config = DISBANDING.config("easy", {"attack_budget": budget, "tau_s": tau_s})
    values = REPLANNING.values(np.zeros((1, len(REPLANNING.numbers))))
    for name, value in numbers.items():
        values[0, REPLANNING.names.index(name)] = value
    attacker = Members(DISBANDING.game(config, 1).spec("attacker"), REPLANNING, values)
    games: list[Any] = []
    play_episodes(DISBANDING, config, {"attacker": attacker, "defender": defender}, [0], on_step=games.append)
    found: FloatArray = games[-1].truth(0)["disbanding_s"]
    return found


def test_platoons_fall_from_front_to_rear_as_far_as_the_budget_goes() -> None:
    times = times_s("none", 4)
    assert times[0] == 1.0
    assert np.isfinite(times[:4]).all()
    assert (np.diff(times[:4]) > 0).all()
    assert np.isinf(times[4:]).all()


def test_the_last_attack_answers_the_defender_that_it_sees() -> None:
    undefended, slow, close = (times_s(defender, 2)[1] for defender in ("none", "heuristic", "feedback"))
    assert 105.0 <= undefended < slow <= 131.0  # who only just moves is between two of the speeds
    assert close < 50.0


def test_times_follow_the_lag() -> None:
    early, late = (times_s("none", 2, tau_s, last_3=105.0, last_per_lag=50.0)[1] for tau_s in (0.1, 0.5))
    assert 95.0 <= early < 105.0 < late <= 115.0


def test_it_looks_before_its_last_attack() -> None:
    assert times_s("none", 2, last_0=5.0, last_3=5.0)[1] == 47.0


def test_each_episode_of_a_batch_has_its_own_numbers() -> None:
    config = DISBANDING.config("easy", {"attack_budget": 2, "tau_s": 0.3})
    points = np.zeros((2, len(REPLANNING.numbers)))
    points[1, REPLANNING.names.index("last_0")] = -1.0
    attacker = Members(DISBANDING.game(config, 1).spec("attacker"), REPLANNING, REPLANNING.values(points))
    games: list[Any] = []
    play_episodes(DISBANDING, config, {"attacker": attacker}, [0, 0], on_step=games.append)
    first, second = (games[-1].truth(b)["disbanding_s"][1] for b in range(2))
    assert 4.0 <= first - second <= 8.0
