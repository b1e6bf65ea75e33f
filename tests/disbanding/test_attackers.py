"""The attacker that searches its plan: the genetic algorithm."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cps_baselines.disbanding.genetic import GeneticAlgorithm
from cps_baselines.disbanding.plan_search import SearchResult, search_plan
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.game.play import play_episodes
from cps_envs.core.policies.lookup import resolve_policy
from cps_envs.core.types import Array
from cps_envs.disbanding.problem import DISBANDING
from tests import episodes


def rewards_for_the_front(times: Array) -> Array:
    """Best plan: the front platoons as early as possible."""
    platoons = np.arange(1, times.shape[1] + 1)
    return np.where(np.isfinite(times), platoons * 100.0 - np.where(np.isfinite(times), times, 0.0), 0.0).sum(axis=1)


def search(seed: int = 0, budget: int = 3, **overrides: Any) -> SearchResult:
    return search_plan(rewards_for_the_front, num_platoons=10, budget=budget, latest_s=180, seed=seed, **overrides)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("population=2", "population = 2 must be above the 2"),
        ("population=null", "whole number"),
        ("generations=0", "generations = 0 must be 1 or more"),
        ("objective=intactt", "Did you mean 'intact'"),
        ("progress=0.1", "progress = 0.1 must be a function"),
    ],
)
def test_options_that_make_no_sense_are_refused(option: str, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        resolve_policy(f"ga?{option}", episodes.spec_of(DISBANDING, "attacker", preset="learning"))


def test_in_a_quiet_episode_there_is_nothing_to_plan() -> None:
    config = DISBANDING.config("learning", {"quiet_share": 1.0, "duration_s": 5.0})
    outcome = play_episodes(DISBANDING, config, {"attacker": "ga?generations=1&population=4"}, range(2))
    assert np.isfinite(outcome["return"]).all()


def test_plans_are_distinct_whole_and_within_bounds() -> None:
    seen = []

    def evaluate(times: Array) -> Any:
        seen.extend(times)
        return rewards_for_the_front(times)

    search_plan(evaluate, num_platoons=5, budget=4, latest_s=20, seed=3)
    for times in seen:
        chosen = times[np.isfinite(times)]
        assert len(chosen) == 4
        assert np.all((chosen >= 1) & (chosen <= 20) & (chosen == np.round(chosen)))


def test_no_plan_is_simulated_twice() -> None:
    seen = []
    result = search_plan(
        lambda times: (seen.extend(row.tobytes() for row in times), rewards_for_the_front(times))[1],
        num_platoons=4,
        budget=2,
        latest_s=5,
        seed=0,
    )
    assert len(seen) == len(set(seen)) == result.simulations
    assert result.evaluations >= result.simulations


def test_search_repeats_for_a_seed_and_never_gets_worse() -> None:
    first, again = search(seed=5), search(seed=5)
    assert first.events == again.events
    assert np.all(np.diff(first.history) >= 0)
    assert first.value == pytest.approx(rewards_for_the_front(first.times[np.newaxis])[0])
    assert [platoon for platoon, _ in first.events] == [10, 9, 8]


def test_progress_is_reported_by_generation() -> None:
    calls = []
    search(progress=lambda *call: calls.append(call))
    assert [call[:2] for call in calls] == [(i, 20) for i in range(1, 21)]


def solve(**overrides: Any) -> tuple[dict[str, Array], SearchResult]:
    config = DISBANDING.config("paper", overrides)
    policy = GeneticAlgorithm(DISBANDING.game(config, 1).spec("attacker"))
    outcome = play_episodes(DISBANDING, config, {"attacker": policy, "defender": "none"}, [0])
    (report,) = policy.reports.values()
    return outcome, report


def test_finds_the_lead_platoon_at_the_first_instant() -> None:
    outcome, report = solve(attack_budget=1, tau_s=0.1)
    assert report.events == [(10, 1)]
    assert outcome["return"][0] == pytest.approx(report.value, abs=1e-9)
    assert outcome["velocity_error_all"][0] == pytest.approx(27.664138, abs=1e-4)  # spec 6.8, G1


@pytest.mark.slow
@pytest.mark.parametrize("tau_s", [0.3, 0.5])
def test_finds_the_lead_platoon_for_every_lag(tau_s: float) -> None:
    assert solve(attack_budget=1, tau_s=tau_s)[1].events == [(10, 1)]


def test_plans_against_the_opponent_that_it_will_meet() -> None:
    config = DISBANDING.config("paper", {"duration_s": 12.0, "num_platoons": 3, "attack_budget": 1})
    values = []
    for defender in ("none", "feedback"):
        policy = GeneticAlgorithm(DISBANDING.game(config, 1).spec("attacker"), generations=3, population=8)
        outcome = play_episodes(DISBANDING, config, {"attacker": policy, "defender": defender}, [0])
        (report,) = policy.reports.values()
        assert outcome["return"][0] == pytest.approx(report.value, abs=1e-9)
        values.append(report.value)
    assert values[0] != values[1]


def test_equal_episodes_are_solved_once() -> None:
    config = DISBANDING.config("paper", {"duration_s": 12.0, "num_platoons": 3})
    policy = GeneticAlgorithm(DISBANDING.game(config, 1).spec("attacker"), generations=2, population=6)
    play_episodes(DISBANDING, config, {"attacker": policy, "defender": "none"}, [0, 1, 2])
    assert len(policy.reports) == 1
