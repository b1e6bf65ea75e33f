"""Policies with numbers that a search found: which numbers they have, and what they play with them."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import pytest

from cps_baselines.family import find_family, play_family
from cps_baselines.searched import searched
from cps_envs import PROBLEMS
from cps_envs.core.errors import ConfigurationError
from cps_envs.core.lookup import resolve_policy
from cps_envs.core.play import play_episodes
from tests.episodes import spec_of

SHORT: dict[str, dict[str, Any]] = {
    "disbanding": {"num_platoons": 3, "vehicles_per_platoon": 3, "duration_s": 30.0},
    "fdi": {},
    "hvac": {"num_steps": 260, "onset_step": 210},
    "rogue": {"duration_s": 6.0, "defense_action": "command", "contact": "solid"},
}
POLICIES = {  # reference -> problem, preset, name of its numbers, family, rival
    "bayes": ("hvac", "learning", "bayes", "hvac-bayes-together", "tracker"),
    "warm_tracker": ("hvac", "learning", "warm_tracker", "hvac-tracker-warm", "largest"),
    "hypotheses": ("fdi", "learning", "hypotheses", "fdi-hypotheses", "tracker"),
    "task_tracker": ("fdi", "learning", "task_tracker", "fdi-task-tracker", "cusum"),
    "box_in": ("rogue", "paper", "box_in", "rogue-boxing-in", "square"),
    "cacc": ("disbanding", "easy", "cacc", "disbanding-local", "lead"),
    "cacc?told=broadcast": ("disbanding", "easy", "cacc_broadcast", "disbanding-broadcast", "lead"),
    "cacc?told=radio": ("disbanding", "learning", "cacc_radio", "disbanding-radio", "lead"),
    "cacc?told=robots": ("disbanding", "easy", "cacc_robots", "disbanding-broadcast", "lead"),
}


@pytest.mark.parametrize("reference", POLICIES)
def test_a_policy_plays_its_family_by_the_searched_numbers(reference: str) -> None:
    name, preset, policy, family_name, rival = POLICIES[reference]
    problem, family = PROBLEMS[name], find_family(family_name)
    config = problem.config(preset, SHORT[name])
    numbers = searched(name, policy)
    assert tuple(numbers) == family.names
    players: Any = {family.role: reference, "defender" if family.role == "attacker" else "attacker": rival}
    expected = play_family(family, problem, config, rival, family.row(numbers), [3])["return"]
    assert play_episodes(problem, config, players, [3])["return"] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("problem", PROBLEMS)
def test_searched_numbers_say_how_to_search_them_again(problem: str) -> None:
    from cps_agents.recipes.finding import RECIPES

    kept = json.loads(files(f"cps_baselines.{problem}").joinpath("searched.json").read_text(encoding="utf-8"))
    for entry in kept.values():
        _, command, recipe, *_ = entry["command"].split()
        assert command == "train"
        assert set(entry["numbers"]) == set(find_family(RECIPES[recipe].family).names)
        assert len(entry["commit"]) == 12


def test_each_number_is_an_option() -> None:
    spec = spec_of(PROBLEMS["hvac"], "defender", "learning")
    resolve_policy("bayes?together=0.5", spec)
    for reference, message in (
        ("bayes?togeher=0.5", "no number 'togeher'. Did you mean 'together'"),
        ("bayes?together=much", "must be a number"),
        ("bayes?heat_w=-1", "have to be positive"),
    ):
        with pytest.raises(ConfigurationError, match=message):
            resolve_policy(reference, spec)
    with pytest.raises(ConfigurationError, match="told = 'all' is not known"):
        resolve_policy("cacc?told=all", spec_of(PROBLEMS["disbanding"], "defender", "easy"))
