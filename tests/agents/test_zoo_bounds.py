"""A network sees the same quantities on the same scale in every configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cps_agents.zoo.bounds import rescaling
from cps_envs.registration import find_problem
from tests.agents.trained import save_tiny


def fields(problem: str, role: Any, preset: str, **overrides: Any) -> Any:
    found = find_problem(problem)
    return found.fields[role](found.config(preset, overrides))


def spec(problem: str, role: Any, preset: str, **overrides: Any) -> Any:
    found = find_problem(problem)
    return found.game(found.config(preset, overrides), 1).spec(role)


def test_a_smaller_budget_is_not_mistaken_for_a_full_one(tmp_path: Path) -> None:
    card = save_tiny(tmp_path / "tiny.json", "disbanding", "attacker", overrides={"attack_budget": [1, 4]})
    trained, played = (fields("disbanding", "attacker", "paper", attack_budget=budget) for budget in ([1, 4], 1))
    found = rescaling(card, spec("disbanding", "attacker", "paper", attack_budget=1))
    assert found is not None
    values = np.zeros((2, played.size))
    values[:, played.slices["budget_left"]] = [[1.0], [0.0]]
    values[:, played.slices["time_s"]] = 90.0
    np.testing.assert_allclose(found(played.encode(values)), trained.encode(values), atol=1e-6)
    np.testing.assert_allclose(trained.decode(found(played.encode(values)))["budget_left"], [1.0, 0.0], atol=1e-6)


def test_a_longer_episode_shows_its_seconds(tmp_path: Path) -> None:
    card = save_tiny(tmp_path / "tiny.json", "rogue", "defender", overrides={"duration_s": 60.0})
    played = fields("rogue", "defender", "paper", duration_s=100.0)
    found = rescaling(card, spec("rogue", "defender", "paper", duration_s=100.0))
    assert found is not None
    observation = played.encode(np.full((1, played.size), 50.0))
    left = fields("rogue", "defender", "paper", duration_s=60.0).decode(found(observation))["time_left_s"]
    assert left[0] == pytest.approx(50.0, abs=1e-4)


def test_nothing_is_done_where_bounds_are_the_same_or_observations_are_others(tmp_path: Path) -> None:
    card = save_tiny(tmp_path / "tiny.json", "disbanding", "attacker")
    assert rescaling(card, spec("disbanding", "attacker", "easy", attack_budget=2)) is None
    assert rescaling(card, spec("disbanding", "attacker", "paper", num_platoons=5)) is None


def test_a_policy_plays_the_rescaled_observation(tmp_path: Path) -> None:
    save_tiny(tmp_path / "tiny.json", "disbanding", "attacker", overrides={"attack_budget": [1, 4]})
    problem = find_problem("disbanding")
    game = problem.game(problem.config("paper", {"attack_budget": 1}), 1)
    policy: Any = problem.policy(f"zoo:{tmp_path / 'tiny.json'}", game, "attacker")
    other: Any = problem.policy(
        f"zoo:{tmp_path / 'tiny.json'}", problem.game(problem.config("paper", {"attack_budget": [1, 4]}), 1), "attacker"
    )
    values = np.random.default_rng(0).uniform(0, 1, (20, game.fields["attacker"].size))
    own = fields("disbanding", "attacker", "paper", attack_budget=[1, 4]).encode(values)
    np.testing.assert_array_equal(policy.predict(game.fields["attacker"].encode(values))[0], other.predict(own)[0])
